"""Degrees of one joint among radians, and stamps that are numbers of samples."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.dataset import Finding, Run
from excite_cli.measurement.limits import Limits
from excite_cli.measurement.torque import angle_units
from excite_cli.measurement.units import check_units
from excite_cli.robot.model import Array

JOINTS = ("a", "b", "c")
ONES = np.ones(3)
LIMITS = Limits(-3.0 * ONES, 3.0 * ONES, 3.0 * ONES, np.inf * ONES, np.ones(3, bool))
DEGREES = 180 / np.pi


def run(scale: Array, speeds: bool = False, step: float = 0.01) -> Run:
    """Motion of 1 rad to both sides, each joint times `scale` in the file."""
    t = np.arange(0.0, 20.0, 0.01)
    q = np.column_stack([np.sin(w * t) for w in (1.0, 1.3, 1.7)])
    dq = np.gradient(q, t, axis=0) if speeds else None
    tau = np.random.default_rng(1).normal(size=q.shape)
    return Run("r", np.arange(len(t)) * step, q * scale, tau, dq)


def found(recorded: Run, spec: MeasurementSpec = MeasurementSpec()) -> list[Finding]:
    return check_units([recorded], spec, JOINTS, LIMITS)


@pytest.mark.parametrize("speeds", [False, True])
def test_one_joint_in_degrees_is_told_alone(speeds: bool) -> None:
    (told,) = found(run(np.array([1.0, DEGREES, 1.0]), speeds))
    assert (told.kind, told.severity, told.joints) == ("units", "error", ("b",))
    assert told.settings["measurement.angle"] == {"b": "deg"}


def test_all_joints_in_degrees_are_told_together() -> None:
    """Also where one of them hardly moves."""
    (told,) = found(run(DEGREES * np.array([1.0, 1.0, 0.002])))
    assert told.settings == {"measurement.angle": "deg"}


def test_units_of_each_joint() -> None:
    spec = MeasurementSpec(angle={"b": "deg", "c": 0.5})
    assert angle_units(spec, JOINTS) == pytest.approx([1.0, np.pi / 180, 0.5])


def test_stamps_that_are_numbers() -> None:
    """Of samples 10 ms apart, read as seconds."""
    (told,) = found(run(ONES, step=1.0))
    assert told.severity == "error"
    assert "numbers of the samples" in told.text
    (told,) = found(run(ONES, speeds=True, step=1.0))
    assert told.settings["measurement.clock"] == pytest.approx(0.01, rel=1e-3)


def test_a_slow_log_has_no_numbers_for_stamps() -> None:
    """One sample a second, in which a joint reaches a third of its speed limit."""
    slow = run(ONES)
    t = np.arange(0.0, 200.0)
    q = np.column_stack([np.sin(w * t) for w in (0.9, 0.5, 0.4)])
    assert found(replace(slow, t=t, q=q, tau=np.ones_like(q))) == []
