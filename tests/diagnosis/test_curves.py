"""A wave of about one period over the travelled range, and curves that are none, in MuJoCo."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from benchmarks.battery.outside import HardeningSpring
from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.model import Array
from excite_cli.simulation.ground_truth import plant
from tests.diagnosis.test_changes import ELBOW
from tests.diagnosis.test_friction_with_memory import diagnosed, names
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot


def test_a_ripple_of_one_period_is_named_with_its_size() -> None:
    travelled = 1.5  # about, by the elbow in these runs
    periods = 2 * np.pi * 1.2 / travelled
    shape = {"periods": periods, "phase": 0.7}
    found = diagnosed(plant(kind_named("ripple"), (ELBOW,), 2.0, shape))
    assert names(found) == [("ripple", "elbow")]
    (ripple,) = found.effects
    assert ripple.effect.shape["periods"] == pytest.approx(periods, rel=0.02)
    assert ripple.parameters["amplitude"].value == pytest.approx(2.0, rel=0.05)
    assert found.after.mean_relative_moving < 0.3 * found.before.mean_relative_moving


def test_a_spring_that_hardens_is_no_ripple() -> None:
    found = diagnosed(plant(HardeningSpring, (ELBOW,), 6.0, {"rest": 0.3}))
    assert not names(found)
    told = [e for e in found.effects if e.approximates] or found.unexplained
    assert told
    for each in found.effects:
        assert each.approximates is not None
        (of,) = each.approximates.covariates
        assert (of.quantity, of.joint) == ("position", "elbow")


def test_only_slow_ripples_must_beat_a_curve() -> None:
    """Fourth powers of the angle; five periods over the range are no such curve."""
    signals = signals_of(random_robot(4, joints=3, branches=False, prismatic=False))
    travelled = float(np.ptp(signals.q[:, 0]))
    ripple = kind_named("ripple")
    slow = ripple((0,), {"periods": 2 * np.pi * 1.2 / travelled}).curve(signals, [signals])
    assert slow is not None
    x = signals.q[:, 0]
    powers = np.stack([x**k for k in range(5)], axis=-1)
    columns: Array = slow[:, 0]
    rest = columns - powers @ np.linalg.lstsq(powers, columns, rcond=None)[0]
    assert np.abs(rest).max() < 1e-6
    assert ripple((0,), {"periods": 2 * np.pi * 5 / travelled}).curve(signals, [signals]) is None
