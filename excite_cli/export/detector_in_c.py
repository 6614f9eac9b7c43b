"""The collision detector of a model's C file: thresholds, their low pass, and a test of both."""

from importlib.resources import files

import numpy as np

from excite_cli.effects.c_code import real, reals
from excite_cli.export.gaps import filled
from excite_cli.robot.model import Array
from excite_cli.scoring.thresholds import REVERSAL, Residual, Thresholds


def detector_in_c(thresholds: Thresholds, count: int, step: float) -> str:
    """Its code; the test runs over `count` instants, `step` [s] apart."""
    text = (files("excite_cli.export") / "detector_template.c").read_text(encoding="utf-8")
    rows = np.column_stack([thresholds.coefficients, thresholds.level])
    gaps = {
        "FALSE_ALARMS": f"{thresholds.false_alarms:g}",
        "SOUND": ",\n".join(f"    {{{reals(row)}}}" for row in rows),
        "TIME_CONSTANT": real(thresholds.time_constant),
        "REVERSAL": real(REVERSAL),
        "TEST_STEP": repr(step),
        "DETECTED": "\n    " + ",\n    ".join(map(reals, _tested(thresholds, count, step))),
    }
    return filled(text, gaps)


def _tested(thresholds: Thresholds, count: int, step: float) -> Array:
    """Filtered residuals over their thresholds (count, n), of the series that the C code makes."""
    k, j = np.arange(count)[:, None], np.arange(len(thresholds.joint_names))
    residual, speed = np.sin(0.7 * k + j), 0.2 * np.cos(0.3 * k + 2.0 * j)
    run = Residual(residual, speed, 10.0 * np.sin(0.11 * k + j), step)
    return thresholds.filtered(run.residual, step) / thresholds.at(run.speed, run.load)
