"""The robot without effects, its instruments, and what a seed decides."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.errors import ConfigError, MissingExtraError, RobotError
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.model import Robot
from excite_cli.simulation.build import Build, make
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.mujoco_model import silent_engine
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.trajectory.bspline import BSplineTrajectory
from tests.robot.random_robots import random_robot
from tests.simulation.arms import ELBOW, IDEAL, beyond_rigid, motion, played, rms

pytest.importorskip("mujoco")


def test_the_motion_is_followed_although_the_controller_knows_the_urdf_only(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rigid bodies alone explain the torque of a bare robot."""
    simulation = played(robot)
    (run,) = simulation.dataset.runs
    wanted, _, _ = motion(robot).states(run.t)
    error = rms(wanted - run.q)
    assert error.max() < 1e-3
    assert simulation.tracking["motion_1"] == pytest.approx(error, rel=0.05)
    assert np.array_equal(run.extra["q_ref"], wanted)
    assert run.t[0] == 0.0
    assert len(run.t) == 2000
    assert run.dq is not None
    share = rms(beyond_rigid(robot, simulation)) / rms(run.tau)
    assert share.max() < 2e-3, share
    assert share[:3].max() < 5e-4, share
    (odd,) = played(robot, control_rate=300.0, rate=130.0, bandwidth=40.0).dataset.runs
    assert odd.step == pytest.approx(1 / 130), "odd rates keep time"
    assert rms(motion(robot).states(odd.t)[0] - odd.q).max() < 5e-3
    (twice,) = played(robot, periods=2).dataset.runs
    assert len(twice.t) == 4000
    assert twice.q[:2000] == pytest.approx(twice.q[2000:], abs=2e-3)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[sim\]'"):
        played(robot)


def test_a_floating_base_stands_still_on_its_hoist() -> None:
    robot = random_robot(3, joints=4, floating=True, prismatic=False)
    trajectory = motion(robot)
    simulation = simulate(robot, [trajectory], IDEAL)
    left = rms(beyond_rigid(robot, simulation)) / rms(simulation.dataset.runs[0].tau)
    assert left.max() < 5e-3


def test_a_motion_that_is_not_periodic_is_entered_and_left(robot: Robot) -> None:
    rng = np.random.default_rng(2)
    trajectory = BSplineTrajectory(3.0, 10, at_rest=False)
    planned = PlannedMotion("motion_1", trajectory, 0.4 * rng.normal(size=(10, robot.n)))
    simulation = simulate(robot, [planned], IDEAL)
    assert simulation.tracking["motion_1"].max() < 5e-3
    with pytest.raises(ConfigError, match="only periodic motions"):
        simulate(robot, [planned], replace(IDEAL, periods=2))


def test_the_same_seed_gives_the_same_numbers(robot: Robot) -> None:
    first, again, other = (
        simulate(robot, [motion(robot)], SimulationSettings(seed=seed)) for seed in (1, 1, 2)
    )
    for name in ("t", "q", "tau", "dq"):
        one, two = (getattr(s.dataset.runs[0], name) for s in (first, again))
        assert np.array_equal(one, two)
    assert np.array_equal(first.truth.phi, again.truth.phi)
    assert not np.array_equal(first.truth.phi, other.truth.phi)
    assert not np.array_equal(first.dataset.runs[0].tau, other.dataset.runs[0].tau)


def test_noise_is_of_the_size_and_correlation_asked_for(robot: Robot) -> None:
    ideal = played(robot).dataset.runs[0]

    def lagged(noise: np.ndarray) -> np.ndarray:
        return np.mean(noise[1:] * noise[:-1], axis=0) / np.mean(noise**2, axis=0)

    noise = played(robot, torque_noise=0.02, noise_correlation=0.7).dataset.runs[0].tau - ideal.tau
    assert rms(noise) / rms(ideal.tau) == pytest.approx(np.full(robot.n, 0.02), rel=0.15)
    assert lagged(noise) == pytest.approx(np.full(robot.n, 0.7), abs=0.08)
    first, second = played(robot, torque_noise=0.02, repeat=2).dataset.runs
    assert np.abs(lagged(first.tau - ideal.tau)).max() < 0.1
    # Takes repeat a motion with fresh noise; without pauses they have no stamps.
    assert (first.name, second.name) == ("motion_1_take_1", "motion_1_take_2")
    assert np.array_equal(first.q, second.q)
    apart = rms(first.tau - second.tau) / rms(first.tau)
    assert apart == pytest.approx(np.full(robot.n, 0.02 * np.sqrt(2)), rel=0.15)
    assert (first.epoch, second.epoch) == (None, None)
    assert second.start == pytest.approx(first.duration)


def test_encoders_count(robot: Robot) -> None:
    step = 1e-3
    run = played(robot, encoder=step).dataset.runs[0]
    counts = run.q / step
    assert np.abs(counts - np.round(counts)).max() < 1e-6
    assert 0.2 * step < rms(run.q - played(robot).dataset.runs[0].q).max() < 0.4 * step
    assert run.dq is not None
    true_speed = motion(robot).states(run.t)[1]
    assert 0.01 < rms(run.dq - true_speed)[0] < 0.5  # a drive's speed is noisy at this resolution


def test_declared_effects_are_there_in_plausible_sizes(robot: Robot) -> None:
    declared = [ViscousFriction((ELBOW,)), CoulombFriction((ELBOW,)), CoulombFriction((0,))]
    simulation = simulate(robot, [motion(robot)], IDEAL, (), declared)
    assert [p.declared for p in simulation.truth.effects] == [True] * 3
    assert all(p.values[0] > 0 for p in simulation.truth.effects)
    share = rms(beyond_rigid(robot, simulation)) / rms(simulation.dataset.runs[0].tau)
    assert 0.003 < share[ELBOW] < 0.3
    assert 0.003 < share[0] < 0.3
    assert share[1] < 1e-3
    slow = replace(motion(robot), coefficients=0.5 * motion(robot).coefficients)
    other = simulate(robot, [slow], IDEAL, (), declared)
    assert [p.values for p in other.truth.effects] == [p.values for p in simulation.truth.effects]


def test_motors_stop_at_their_limits_if_asked(robot: Robot) -> None:
    free = played(robot).dataset.runs[0]
    level = 0.8 * np.abs(free.tau[:, ELBOW]).max()
    curves = [EffortCurve.constant(np.inf)] * robot.n
    curves[ELBOW] = EffortCurve.constant(level)
    limits = replace(robot.limits, curves=tuple(curves))
    weak = replace(robot, limits=limits)
    run = played(weak, torque_limits=True).dataset.runs[0]
    assert np.abs(run.tau[:, ELBOW]).max() <= level + 1e-9
    assert np.abs(played(weak).dataset.runs[0].tau[:, ELBOW]).max() > level


def test_a_robot_that_runs_away_or_moves_no_inertia_is_told(robot: Robot) -> None:
    torn = plant(kind_named("spring"), (ELBOW,), -1e5)
    with pytest.raises(RobotError, match=r"'motion_1'.* ran away at .*joint"):
        played(robot, torn)
    empty = Build.bare(robot, np.zeros(10 * robot.n_bodies), RunId("motion_1"))
    words = r"'shoulder_pan_joint' moves no inertia(.|\n)*armature@"
    with silent_engine(), pytest.raises(RobotError, match=words):
        make(empty, 5e-4)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"rate": 5000.0}, "rate: 5000 Hz cannot be recorded"),
        ({"noise_correlation": 1.0}, "not between -1 and 1"),
        ({"inertia_error": 2.0}, "not between 0 and 0.6"),
        ({"torque_noise": -1.0}, "torque noise"),
        ({"repeat": 0}, "repeat"),
    ],
)
def test_settings_that_cannot_be(wrong: dict[str, float], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        SimulationSettings(**wrong)  # type: ignore[arg-type]


def test_friction_goes_on_changing_from_one_recording_to_the_next(robot: Robot) -> None:
    """By the campaign's clock: the same motion meets more friction after a pause."""
    shape = {"time_constant": 2e4, "span": 1000.0}
    growing = plant(kind_named("friction_change"), (ELBOW,), 30.0, shape)
    settings = replace(IDEAL, repeat=2, pause=500.0)
    first, second = simulate(robot, [motion(robot)], settings, [growing]).dataset.runs
    length = first.duration
    assert (first.start, second.start) == pytest.approx((0.0, length + 500.0))
    assert second.epoch is not None
    assert first.epoch is not None
    assert second.epoch - first.epoch == pytest.approx(length + 500.0)
    more = (second.tau - first.tau)[:, ELBOW]
    moving = np.abs(first.dq[:, ELBOW]) > 0.1  # type: ignore[index]
    expected = 30.0 * second.start / 1000.0
    assert np.median(more[moving] * np.sign(first.dq[moving, ELBOW])) == pytest.approx(  # type: ignore[index]
        expected, rel=0.1
    )
