"""Enclosed kinematics, rows and distances against the same at instants within the intervals."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, Piece
from excite_cli.dynamics.whole_robot import whole_parameters
from excite_cli.geometry.obstacle_pairs import ObstacleDistances
from excite_cli.geometry.obstacles import Box, Plane
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.proof.enclosed_distances import EnclosedCapsules, least_clearances
from excite_cli.proof.enclosed_motion import EnclosedMotion, enclosed_states, intervals_of
from excite_cli.proof.enclosed_rows import combined, ground_rows, least_of, mass_rows, torque_rows
from excite_cli.proof.taylor import Taylor
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.robot.coupled_robots import CLAW, coupled_robot
from tests.robot.random_robots import random_robot

ROUNDING = 1e-9
AT = (-1.0, -0.4, 0.0, 0.7, 1.0)


def motion_of(robot: Robot, seed: int, width: float) -> tuple[EnclosedMotion, list]:
    """An enclosed random motion, with (states, s) at instants of its intervals."""
    rng = np.random.default_rng(seed)
    family = FourierTrajectory(3, 1.5)
    coefficients = rng.normal(size=(family.n_coefficients, robot.n)) * 0.4
    intervals = intervals_of(family, width).only(slice(0, 40, 7))
    motion = EnclosedMotion(robot, enclosed_states(family, coefficients, intervals))
    instants = [
        (family.basis(intervals.middles + s * intervals.halves).states(coefficients), s) for s in AT
    ]
    return motion, instants


def full(robot: Robot, states: tuple) -> zip:
    q, v, a = states
    return zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)


def off(model, value: np.ndarray, s: float) -> float:
    """By how much a value leaves its enclosure."""
    return float((np.abs(value - model.at(s)) - model.radius).max())


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**5), st.booleans(), st.sampled_from([0.05, 0.005]))
def test_bodies_lie_within(seed: int, floating: bool, width: float) -> None:
    bodies_within(random_robot(seed, 5, floating), seed, width)


@pytest.mark.parametrize("width", [0.05, 0.005])
def test_bodies_of_joints_that_follow_lie_within(width: float) -> None:
    bodies_within(coupled_robot(CLAW), 1, width)


def bodies_within(robot: Robot, seed: int, width: float) -> None:
    motion, instants = motion_of(robot, seed, width)
    data = robot.model.createData()
    local = np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0]])
    for states, s in instants:
        for t, (q, v, a) in enumerate(full(robot, states)):
            pin.forwardKinematics(robot.model, data, q, v, a)
            for body in range(1, robot.model.njoints):
                place = data.oMi[body]
                turn, origin = motion.placements[body]
                assert off(turn[t], place.rotation, s) < ROUNDING
                assert off(origin[t], place.translation, s) < ROUNDING
                points = local @ place.rotation.T + place.translation
                assert off(motion.points(body, local)[t], points, s) < ROUNDING
                aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
                speed = pin.getVelocity(robot.model, data, body, aligned)
                classical = pin.getClassicalAcceleration(robot.model, data, body, aligned)
                rates = motion.rates[body]
                assert off(rates.spin[t], speed.angular, s) < ROUNDING
                assert off(rates.spin_rate[t], classical.angular, s) < 1e-8
                lifted = classical.linear - robot.model.gravity.linear
                assert off(rates.acceleration[t], lifted, s) < 1e-8


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**5), st.booleans())
def test_torques_and_mass_lie_within(seed: int, floating: bool) -> None:
    robot = random_robot(seed, 5, floating, rows=("joints",) if floating else None)
    torques_and_mass_within(robot, seed)


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_torques_of_joints_with_followers_lie_within(base: str) -> None:
    torques_and_mass_within(coupled_robot(CLAW, base=base), 1)


def torques_and_mass_within(robot: Robot, seed: int) -> None:
    motion, instants = motion_of(robot, seed, 0.02)
    model, data = robot.model, robot.model.createData()
    rows, first = torque_rows(motion), mass_rows(motion)
    phi = whole_parameters(robot)
    torque = rows.through(phi[None, 10:])[..., 0]
    moment = first.through(phi[None])[..., 0]
    for states, s in instants:
        for t, (q, v, a) in enumerate(full(robot, states)):
            moved, gathered = robot.tree.moved, robot.gathered
            regressor = pin.computeJointTorqueRegressor(model, data, q, v, a)[moved]
            assert off(rows[t], gathered(regressor.T).T, s) < 1e-8
            assert off(torque[t], gathered(pin.rnea(model, data, q, v, a)[moved]), s) < 1e-8
            center = pin.centerOfMass(model, data, q)
            total = sum(inertia.mass for inertia in model.inertias[1:])
            still = model.inertias[0]
            expected = total * center + still.mass * still.lever
            weighed = np.array([total + still.mass, *expected[:2]])
            assert off(moment[t], weighed, s) < 1e-8
    assert torque.radius.max() < 0.1 * np.abs(torque.center).max()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_ground_carries_what_the_base_needs(seed: int) -> None:
    """The wrench at a floating base, moved to the point that is asked about."""
    robot = random_robot(seed, 5, floating=True, rows=("base", "joints"))
    motion, instants = motion_of(robot, seed, 0.02)
    about = np.array([0.3, -0.2, -0.5])
    model, data = robot.model, robot.model.createData()
    wrench = ground_rows(motion, about).through(whole_parameters(robot)[None])[..., 0]
    for states, s in instants:
        for t, (q, v, a) in enumerate(full(robot, states)):
            local = pin.Force(pin.rnea(model, data, q, v, a)[:6])
            pin.forwardKinematics(model, data, q)
            world = data.oMi[1].act(local)
            moment = world.angular - np.cross(about, world.linear)
            expected = np.concatenate([world.linear, moment])
            assert off(wrench[t], expected, s) < 1e-8


def test_enclosures_of_torque_shrink_with_the_third_power() -> None:
    robot = random_robot(3, 5)
    phi = whole_parameters(robot)[None, 10:]
    radii = [
        torque_rows(motion_of(robot, 3, width)[0]).through(phi).radius for width in (0.02, 0.01)
    ]
    assert radii[0].max() / radii[1].max() > 6.0


def uncertainty(rng: np.random.Generator, size: int) -> InertiaUncertainty:
    center = rng.normal(size=size)
    box = Piece(center, rng.uniform(0, 0.3, size), np.zeros((0, size)))
    both = Piece(center, 0.1 * rng.normal(size=(size, size)), 0.2 * rng.normal(size=(3, size)))
    return InertiaUncertainty((box, both))


def functional(rng: np.random.Generator, spread: float) -> Taylor:
    scale = np.array([1.0, spread, spread**2]).reshape(3, 1, 1, 1)
    return Taylor(rng.normal(size=(3, 4, 2, 6)) * scale, spread**3 * rng.uniform(0, 1, (4, 2, 6)))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.01, 0.2, 1.5]))
def test_bound_holds_at_every_instant(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    y, known = functional(rng, spread), uncertainty(rng, 6)
    bound = least_of(y, known)
    error = rng.uniform(-1, 1, y.shape)
    for s in np.linspace(-1, 1, 21):
        assert np.all(known.least(y.at(s) + error * y.radius) >= bound - 1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_bound_is_tight_for_short_intervals(seed: int) -> None:
    """Off by no more than the crossing of signs and the radius explain: both go with the spread."""
    rng = np.random.default_rng(seed)
    known = uncertainty(rng, 6)
    for spread in (0.02, 0.002):
        y = functional(np.random.default_rng(seed), spread)
        at = np.min([known.least(y.at(s)) for s in np.linspace(-1, 1, 41)], axis=0)
        assert float(np.max(at - least_of(y, known))) < 2.5 * spread


def test_combinations_of_rows() -> None:
    rng = np.random.default_rng(3)
    rows, a = functional(rng, 0.3), rng.normal(size=(5, 2))
    found = combined(a, rows)
    error = rng.uniform(-1, 1, rows.shape)
    for s in (-1.0, 0.3, 1.0):
        value = a @ (rows.at(s) + error * rows.radius)
        assert np.all(np.abs(value - found.at(s)) <= found.radius + 1e-12)


FAMILY = FourierTrajectory(3, 2.0)
INSIDE = np.linspace(-1, 1, 21)


def capsules_of(robot: Robot, rng: np.random.Generator) -> tuple[Capsule, ...]:
    """One per body and one that stands; one of them a ball."""
    found = []
    for joint in range(robot.model.njoints):
        start = rng.normal(size=3) * 0.3
        end = start if joint == 2 else start + rng.normal(size=3) * 0.4
        found.append(Capsule(f"link_{joint}", joint, start, end, 0.02, (f"link_{joint}",)))
    return tuple(found)


def assert_bounded(seed: int, width: float, least, true) -> np.ndarray:
    """The truth, which the bounds do not exceed and are near."""
    robot = random_robot(seed, 4)
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(size=(FAMILY.n_coefficients, robot.n)) * 0.5
    capsules = capsules_of(robot, rng)
    intervals = intervals_of(FAMILY, width).only(slice(0, 60, 3))
    motion = EnclosedMotion(robot, enclosed_states(FAMILY, coefficients, intervals))
    bound, values = least(EnclosedCapsules(capsules, motion)), []
    for s in INSIDE:
        times = intervals.middles + s * intervals.halves
        values.append(true(robot, capsules, FAMILY.basis(times).states(coefficients)[0]))
    truth = np.min(values, axis=0)
    assert np.all(bound <= truth + 1e-9)
    if width < 0.1:
        apart = truth > 0.03
        assert np.quantile((truth - bound)[apart], 0.9) < 2e-3
    return truth


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("width", [0.2, 0.02])
def test_capsules(seed: int, width: float) -> None:
    pairs = [(i, j) for i in range(5) for j in range(i + 1, 5)]
    first, second = np.array(pairs).T
    least = assert_bounded(
        seed,
        width,
        lambda axes: axes.least_distances(first, second, 10.0),
        lambda robot, capsules, q: PairDistances(robot, capsules, pairs).distances(q),
    )
    assert width > 0.1 or (least > 0.03).sum() > 20


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("width", [0.2, 0.02])
def test_obstacles(seed: int, width: float) -> None:
    rng = np.random.default_rng(seed + 100)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    things = (
        Plane("wall", turn[0], -1.0),
        Box("box", turn * np.sign(np.linalg.det(turn)), rng.normal(size=3), np.full(3, 0.2)),
    )
    which = np.arange(5)
    for index, thing in enumerate(things):
        pairs = [(capsule, index) for capsule in range(5)]
        assert_bounded(
            seed,
            width,
            lambda axes, thing=thing: least_clearances(axes, thing, which, 10.0),
            lambda robot, capsules, q, pairs=pairs: ObstacleDistances(
                robot, capsules, things, pairs
            ).distances(q),
        )
