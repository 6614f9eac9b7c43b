"""Set points that lead a motion: the robot plays it, and limits of joints are kept."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.measurement.torque_sources.command import DriveLaw
from excite_cli.robot.model import Robot
from excite_cli.simulation.leading import LeadingSetPoints
from excite_cli.simulation.position_drive import PositionDrive
from tests.simulation.arms import motion, played
from tests.simulation.test_position_drive import DRIVE, KD, KP, QUICK

LAW = DriveLaw(np.array(KP), np.array(KD), np.full(6, np.inf), 0.02)


@pytest.mark.long
@pytest.mark.parametrize("speeds", [False, True])
def test_the_robot_plays_the_motion(robot: Robot, speeds: bool) -> None:
    pytest.importorskip("mujoco")
    plain = replace(DRIVE, set_point_speeds=speeds)
    far, near = (
        played(robot, settings=replace(QUICK, inertia_error=0.0, drive=replace(plain, lead=lead)))
        for lead in (False, True)
    )
    error, better = far.tracking["motion_1"], near.tracking["motion_1"]
    assert np.all(better < 0.2 * error)
    assert better.max() < 0.006
    (run,) = near.dataset.runs
    sent = DRIVE.sent(run.t)
    leading = LeadingSetPoints(motion(robot), robot, LAW, 0.01, speeds)
    np.testing.assert_allclose(run.extra["q_cmd"], leading.positions(sent))
    assert near.truth.drive is not None
    assert near.truth.drive["lead"] is True


def test_derivatives_are_those_of_the_set_points(robot: Robot) -> None:
    leading = LeadingSetPoints(motion(robot), robot, LAW, 0.01)
    t = np.linspace(0.0, 4.0, 4001)
    q, v, a = leading.states(t)
    assert np.abs(np.gradient(q, t, axis=0) - v)[1:-1].max() < 1e-6
    assert np.abs(np.gradient(v, t, axis=0) - a)[1:-1].max() < 1e-2
    planned = motion(robot).states(t + 0.02 + 0.005)
    with_speeds = replace(leading, speeds=True).states(t)
    np.testing.assert_array_equal(with_speeds[1], planned[1])
    apart = q - with_speeds[0]
    np.testing.assert_allclose(apart, np.array(KD) * planned[1] / np.array(KP), atol=1e-12)


def test_set_points_stay_within_the_limits_of_joints_and_it_is_told(robot: Robot) -> None:
    t = np.linspace(0.0, 4.0, 401)
    free = LeadingSetPoints(motion(robot), robot, LAW, 0.01)
    assert free.clipped(t, "motion_1") is None
    most = robot.limits.upper.copy()
    most[2] = free.positions(t)[:, 2].max() - 0.05
    narrow = replace(robot, limits=replace(robot.limits, upper=most))
    leading = replace(free, robot=narrow)
    assert leading.positions(t)[:, 2].max() == most[2]
    note = leading.clipped(t, "motion_1")
    assert note is not None
    assert (
        "set points of elbow_joint would leave the joints' position limits, by up to 0.05 rad"
        in (note.sentence)
    )


def test_the_limit_of_a_drive_is_kept(robot: Robot) -> None:
    pytest.importorskip("mujoco")
    weak = PositionDrive.of_law(replace(LAW, limit=np.array([40.0, 60, 20, 5, 5, np.inf])), False)
    simulation = played(robot, settings=replace(QUICK, drive=weak))
    assert simulation.truth.drive is not None
    assert list(simulation.truth.drive["limit"].values())[:2] == [40.0, 60.0]
    strong = played(robot, settings=replace(QUICK, drive=replace(weak, limit=())))
    assert simulation.tracking["motion_1"][1] > 5 * strong.tracking["motion_1"][1], "it sinks"
