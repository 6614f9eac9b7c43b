"""Torque by speed that is kept below another bound, too."""

import numpy as np
import pytest

from excite_cli.robot.effort_curve import EffortCurve

CURVES = {
    "constant": ([0], [10]),
    "falling": ([0, 1, 3], [10, 9, 3]),
    "flat at last": ([0, 1, 3], [10, 9, 9]),
    "one line that goes on": ([0, 1], [10, 9]),
    "flat at first": ([0, 1, 2], [10, 10, 9]),
}


@pytest.mark.parametrize("most", [12.0, 10.0, 9.5, 9.0, 4.0, 0.5])
@pytest.mark.parametrize("name", CURVES)
def test_it_is_the_lesser_of_both_at_every_speed(name: str, most: float) -> None:
    curve = EffortCurve(*(np.array(each, dtype=float) for each in CURVES[name]))
    speed = np.linspace(-3.0, 20.0, 2001)
    capped = curve.capped(most)
    np.testing.assert_allclose(capped.effort(speed), np.minimum(curve.effort(speed), most))
    assert (capped is curve) == (most >= 10.0)
    assert np.all(np.diff(capped.speeds) > 0)
    assert np.all(np.diff(capped.efforts) <= 0)


def test_falling_while_it_drives() -> None:
    curve = EffortCurve.falling(4.0, 1.5)
    np.testing.assert_allclose(curve.effort(np.array([-2.0, 0.0, 1.0, 4.0])), [4, 4, 2.5, -2])
    assert EffortCurve.falling(4.0, 0.0).effort(np.array([9.0])) == 4.0
    assert EffortCurve.falling(np.inf, 1.5).effort(np.array([9.0])) == np.inf
