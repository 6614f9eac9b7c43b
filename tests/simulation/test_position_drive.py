"""Drives that follow set points: the torque is their law; the log holds what such robots log."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.errors import ConfigError, RobotError
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import assemble
from excite_cli.simulation.position_drive import PositionDrive, parse_gains
from excite_cli.simulation.set_point_control import SetPointControl
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation
from tests.simulation.arms import (
    ELBOW,
    IDEAL,
    arm,
    beyond_rigid,
    inner,
    motion,
    planted,
    played,
    rms,
    states,
)

pytest.importorskip("mujoco")
KP, KD = (4000.0, 4000.0, 2000.0, 400.0, 400.0, 100.0), (200.0, 200.0, 80.0, 10.0, 10.0, 2.0)
DRIVE = PositionDrive(KP, KD, command_rate=100.0, delay=0.02)
# A drive that is quick beside what it drives: its law acts at the instant that it is taken at.
QUICK = replace(IDEAL, rate=4000.0, control_rate=4000.0, step=2.5e-4, lead_in=1.0, drive=DRIVE)


@pytest.fixture(scope="module")
def followed(robot: Robot) -> Simulation:
    return played(robot, settings=QUICK)


def law(simulation: Simulation, delay: float = DRIVE.delay, speeds: bool = False) -> Array:
    """The drive's law on the log: set points `delay` ago, positions, speeds."""
    (run,) = simulation.dataset.runs
    drive = replace(DRIVE, set_point_speeds=speeds)
    q, v, _ = states(run)
    set_point, speed = drive.set_points(motion(arm()), run.t - delay)
    return np.array(KP) * (set_point - q) + np.array(KD) * (speed - v)


def missed(simulation: Simulation, torque: Array) -> Array:
    """RMS (n,) of what `torque` leaves of that of the true rigid bodies, by its size.

    Means over the time of a set point: no derivative follows the jumps between them.
    """
    bare = replace(simulation.dataset.runs[0], tau=torque)
    whole = replace(simulation, dataset=replace(simulation.dataset, runs=(bare,)))
    left = beyond_rigid(arm(), whole)
    means = [np.convolve(column, np.ones(40) / 40, "valid") for column in left.T]
    return rms(np.stack(means, axis=1)) / rms(torque)


def test_the_law_is_the_torque(robot: Robot, followed: Simulation) -> None:
    assert missed(followed, law(followed)).max() < 0.02
    assert missed(followed, law(followed, delay=0.01)).min() > 0.1, "set points act late"
    faster = replace(QUICK, drive=replace(DRIVE, set_point_speeds=True))
    quick = played(robot, settings=faster)
    assert missed(quick, law(quick, speeds=True)).max() < 0.02
    (run,) = quick.dataset.runs
    assert np.array_equal(run.extra["v_cmd"], motion(robot).states(DRIVE.sent(run.t))[1])
    assert quick.tracking["motion_1"].max() < followed.tracking["motion_1"].max()


def test_the_log_holds_set_points_and_no_torque(followed: Simulation) -> None:
    (run,) = followed.dataset.runs
    assert np.isnan(run.tau).all()
    assert run.dq is None
    assert set(run.extra) == {"q_cmd"}
    sent = run.extra["q_cmd"]
    assert np.array_equal(sent[::40], motion(arm()).states(run.t[::40])[0]), "100 of 4000 Hz"
    assert np.array_equal(sent[39::40], sent[::40]), "held in between"
    assert followed.lag["motion_1"] == pytest.approx(np.abs(sent - run.q).max(axis=0))
    name, joint, size = followed.farthest
    assert (name, size) == ("motion_1", followed.lag["motion_1"][joint])
    assert size == followed.lag["motion_1"].max()


def test_truth_holds_the_law(robot: Robot, followed: Simulation) -> None:
    drive = followed.truth.record()["drive"]
    assert isinstance(drive, dict)
    assert list(drive["kp"].values()) == list(KP)
    assert list(drive["kd"]) == list(robot.joint_names)
    assert (drive["delay"], drive["command_rate"], drive["limit"]) == (0.02, 100.0, None)
    assert "drive" not in played(robot, lead_in=0.1).truth.record()
    assert not played(robot, lead_in=0.1).lag


def test_torque_limits_are_those_of_the_drive(robot: Robot) -> None:
    lazy = np.array([40.0, 60.0, 20.0, 5.0, 5.0, 1.0])
    curves = tuple(replace(c, efforts=np.array([x])) for c, x in zip(
        robot.limits.curves, lazy, strict=True))  # fmt: skip
    weak = replace(robot, limits=replace(robot.limits, curves=curves))
    simulation = played(weak, settings=replace(QUICK, torque_limits=True))
    wanted = law(simulation)
    clipped = np.clip(wanted, -lazy, lazy)
    assert (np.abs(wanted) > lazy)[:, 1].mean() > 0.1, "it does saturate"
    bare = missed(simulation, wanted)[1], missed(simulation, clipped)[1]
    assert bare[0] > 5 * bare[1]
    assert simulation.truth.drive is not None
    assert list(simulation.truth.drive["limit"].values()) == list(lazy)


def test_the_drive_knows_what_its_encoder_counts(robot: Robot) -> None:
    step = 0.05
    build = assemble(robot, standard_parameters(robot), RunId("a"), ())
    t = np.arange(10) / 1000.0
    control = SetPointControl(DRIVE, build, motion(robot), t, step)
    q, v = np.linspace(-1.01, 0.93, 6), np.linspace(0.3, -0.2, 6)
    wanted, _ = DRIVE.set_points(motion(robot), t[3:4] - DRIVE.delay)
    counted = np.round(q / step) * step
    law = np.array(KP) * (wanted[0] - counted) - np.array(KD) * v
    np.testing.assert_allclose(control.torque(3, q, v), law)
    (run,) = played(robot, settings=replace(QUICK, encoder=step, lead_in=0.1)).dataset.runs
    assert np.allclose(run.q / step, np.round(run.q / step)), "and so does the log"


def test_the_law_may_be_wrong_by_gain_and_offset(robot: Robot) -> None:
    wrong = played(
        robot,
        planted("torque_gain", (ELBOW,), 0.25),
        planted("torque_offset", (ELBOW,), 5.0),
        settings=QUICK,
    )
    torque = law(wrong)
    torque[:, ELBOW] = (torque[:, ELBOW] - 5.0) / 1.25
    assert missed(wrong, torque)[ELBOW] < 0.005
    assert missed(wrong, law(wrong))[ELBOW] > 0.05


def test_effects_are_in_the_robot(robot: Robot) -> None:
    stuck = played(robot, planted("coulomb_friction", (ELBOW,), 20.0), settings=QUICK)
    (run,) = stuck.dataset.runs
    bare = replace(run, tau=law(stuck))
    left = beyond_rigid(robot, replace(stuck, dataset=replace(stuck.dataset, runs=(bare,))))
    moving = np.abs(inner(states(run)[1][:, ELBOW])) > 0.1
    sign = np.sign(inner(states(run)[1][:, ELBOW]))
    assert np.mean((left[:, ELBOW] * sign)[moving]) == pytest.approx(20.0, rel=0.1)


def test_what_measures_no_torque_has_no_faults_of_it(robot: Robot) -> None:
    for kind, value in (("torque_delay", 0.002), ("torque_saturation", 5.0)):
        with pytest.raises(ConfigError, match=r"measures no torque.*--command-delay"):
            played(robot, planted(kind, (ELBOW,), value), settings=QUICK)
    clipped = planted("torque_saturation", (ELBOW,), 10.0, actuator=1.0)
    assert played(robot, clipped, settings=replace(QUICK, lead_in=0.1)).lag


def test_a_robot_that_runs_away_is_reported(robot: Robot) -> None:
    wild = replace(IDEAL, drive=replace(DRIVE, kp=(1e5,) * 6, kd=(1e4,) * 6))
    with pytest.raises(RobotError, match=r"ran away.*smaller gains.*at 1000 steps per second"):
        played(robot, settings=wild)


def test_gains_from_words() -> None:
    names = ("hip", "knee=left")
    assert parse_gains("--kp", ["20"], names) == (20.0, 20.0)
    assert parse_gains("--kp", ["hip=5", "20"], names) == (5.0, 20.0)
    assert parse_gains("--kp", ["hip=5", "knee=left=7"], names) == (5.0, 7.0)
    with pytest.raises(ConfigError, match=r"no joint 'hop'. Did you mean 'hip'"):
        parse_gains("--kp", ["1", "hop=5"], names)
    with pytest.raises(ConfigError, match=r"--kd: no gain for knee=left. .* --kd knee=left=NUMBER"):
        parse_gains("--kd", ["hip=5"], names)
    for text in ("", "x", "nan", "hip=", "hip=inf"):
        with pytest.raises(ConfigError, match=r"is not a finite number. Give one number for all"):
            parse_gains("--kp", [text], names)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kp": (0.0, 1.0)}, "--kp: gains must be above 0"),
        ({"kd": (-1.0, 1.0)}, "--kd: gains must not be negative"),
        ({"command_rate": 0.0}, "--command-rate 0: give a rate above 0 Hz"),
        ({"delay": -0.1}, "--command-delay -0.1: allowed: 0 to 1 s"),
        ({"delay": 2.0}, "--command-delay 2: allowed: 0 to 1 s"),
    ],
)
def test_what_no_drive_has(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        replace(PositionDrive((1.0, 1.0), (0.0, 0.0)), **changes)  # type: ignore[arg-type]


def test_set_points_are_not_sent_faster_than_the_drive_runs() -> None:
    drive = PositionDrive((1.0,), (0.0,), command_rate=2000.0)
    with pytest.raises(ConfigError, match=r"--command-rate 2000: allowed: up to .* 1000 Hz"):
        SimulationSettings(drive=drive)
