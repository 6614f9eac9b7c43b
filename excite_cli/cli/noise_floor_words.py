"""The noise floor in tables and words, for `excite identify` and `excite diagnose`."""

import math
from statistics import median

from excite_cli.identification.errors_of_torque import Errors

COLUMN = "noise floor"
_STANDS_OUT = 1.5  # times the typical joint


def floor_columns(floor: dict[str, float] | None) -> list[str]:
    """The column's title, if there is one."""
    return [] if floor is None else [COLUMN]


def floor_cells(floor: dict[str, float] | None, joint: str) -> list[str]:
    """What stands in the column, if there is one."""
    if floor is None:
        return []
    return [f"{floor[joint]:.4g}" if joint in floor else "-"]


def above_the_floor(error: Errors, floor: dict[str, float] | None) -> list[str]:
    """How far the RMS errors lie above the floor: the median joint, and the worst."""
    ratios = {
        joint: error.rms[joint] / level
        for joint, level in (floor or {}).items()
        if level > 0.0 and math.isfinite(error.rms[joint])
    }
    if not ratios:
        return []
    typical, worst = median(ratios.values()), max(ratios, key=lambda joint: ratios[joint])
    stands_out = ratios[worst] > _STANDS_OUT * typical
    return [
        f"What is left is {typical:.1f} times the noise that repeated periods show"
        + f" ({worst} {ratios[worst]:.1f} times)" * stands_out
        + "; about 1 is the best that a model without drift can reach."
    ]
