"""The noise floor in tables, for `excite identify` and `excite diagnose`."""

from math import nan

from excite_cli.summary.cells import figure

COLUMN = "noise floor"


def floor_columns(floor: dict[str, float] | None) -> list[str]:
    """The column's title, if there is one."""
    return [] if floor is None else [COLUMN]


def floor_cells(floor: dict[str, float] | None, joint: str) -> list[str]:
    """What stands in the column, if there is one."""
    if floor is None:
        return []
    return [figure(floor.get(joint, nan))]
