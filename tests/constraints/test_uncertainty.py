"""Limits that hold for every admitted inertia: values against adversaries, gradients, motions."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from excite_cli.config.constraints_spec import (
    ConstraintsSpec,
    ContactSpec,
    DiscSpec,
    PolygonSpec,
    TorqueSpec,
)
from excite_cli.config.load_spec import load_spec
from excite_cli.constraints.balance import Balance
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.constraints.ground_contact import ZeroMomentPoint
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, box, inertia_uncertainty
from excite_cli.dynamics.whole_robot import drawn_states, whole_parameters
from excite_cli.errors import ConfigError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.robot.model import Robot
from tests.constraints.test_gradients import check_gradients
from tests.dynamics.test_uncertain_inertias import SPEC, knowledge
from tests.excitation.smoke import CONFIG, one_motion, smoke
from tests.robot.random_robots import random_robot
from tests.whole_plant import WholePlant

CORNERS = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
ALL = ConstraintsSpec(
    joint_limits=None,
    torque=TorqueSpec(scale=0.7),
    balance=PolygonSpec(kind="polygon", vertices=CORNERS),
    contact=ContactSpec(vertices=CORNERS, height=-0.4, friction=0.6, torsion=0.2, min_load=5.0),
)


def admitted(robot: Robot, fitted: bool, seed: int = 0) -> InertiaUncertainty:
    base = find_base_parameters(robot)
    fit = knowledge(robot, base, seed, 0.1) if fitted else None
    return inertia_uncertainty(SPEC, robot, base, fit)


def by_mujoco(constraint: Constraint, plant: WholePlant, phi: Array, states: States) -> Array:
    """Margins (T, m) of `constraint` for inertias φ, from MuJoCo and first principles."""
    plant.set_inertias(phi)
    torque, wrench, center = plant.inverse(states.q, states.v, states.a)
    if isinstance(constraint, JointTorque):
        return np.hstack(
            [constraint.scale[: plant.n] + torque, constraint.scale[: plant.n] - torque]
        )
    if isinstance(constraint, Balance):
        return constraint.offsets - center[:, :2] @ constraint.normals.T
    force, moment = wrench[:, :3], wrench[:, 3:]
    if isinstance(constraint, ZeroMomentPoint):
        lever = moment - np.cross([0.0, 0.0, constraint.height], force)
        point = np.column_stack([-lever[:, 1], lever[:, 0]]) / force[:, 2:]
        return constraint.support.offsets - point @ constraint.support.normals.T
    found = []
    for label in constraint.labels:
        name, _, side = label.partition(" ")
        if name == "load":
            found.append(force[:, 2] - 5.0)
        elif name == "torsion":  # the middle of the polygon is the world's origin
            found.append(0.2 * force[:, 2] - float(side + "1") * moment[:, 2])
        else:
            axis = "xy".index(side[1])
            found.append(0.6 * force[:, 2] - float(side[0] + "1") * force[:, axis])
    return np.column_stack(found)


@pytest.mark.parametrize("seed", [0, 2])
def test_margins_in_a_box_are_reached_by_a_corner_and_by_none_undercut(seed: int) -> None:
    """An adversary with MuJoCo: it flips each parameter to the side that hurts most, till none."""
    robot = random_robot(seed, joints=3)
    states = standing_slowly(robot, seed)
    phi, reach = whole_parameters(robot), box(SPEC, robot)
    plant, rng = WholePlant(robot), np.random.default_rng(seed)
    for constraint in build_constraints(ALL, robot, admitted(robot, False)):
        margins = constraint.margins(states)
        corners = phi + rng.choice([-1.0, 1.0], (100, len(phi))) * reach
        for corner in corners:
            assert np.all(margins <= by_mujoco(constraint, plant, corner, states) + 1e-9)
        for column in range(0, margins.shape[1], 2):

            def margin(side: Array, of: Constraint = constraint, column: int = column) -> float:
                return float(by_mujoco(of, plant, phi + side * reach, states)[0, column])

            worst = adversary(margin, len(phi))
            assert np.isclose(margins[0, column], worst, rtol=1e-6, atol=1e-9), constraint.name


def standing_slowly(robot: Robot, seed: int) -> States:
    """Motion slow enough that the ground must push, whatever the inertias."""
    states = drawn_states(robot, 1, seed)
    return States(states.kinematics, states.q, 0.3 * states.v, 0.1 * states.a)


def adversary(margin: Callable[[Array], float], size: int) -> float:
    """The least margin that ascent over the corners finds, coordinate by coordinate."""
    side = np.zeros(size)
    best, before = margin(side), np.inf
    while best < before - 1e-12:
        before = best
        for index in range(size):
            for sign in (-1.0, 1.0):
                tried = side.copy()
                tried[index] = sign
                if (value := margin(tried)) < best:
                    best, side = value, tried
    return best


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("fitted", [False, True])
def test_gradients_are_those_of_the_margins(seed: int, fitted: bool) -> None:
    robot = random_robot(seed, joints=4, floating=seed % 2 == 1)
    for constraint in build_constraints(ALL, robot, admitted(robot, fitted, seed)):
        check_gradients(robot, constraint, seed, 1e-6)


def test_margins_after_a_fit_hold_for_all_in_box_and_ellipsoid() -> None:
    robot = random_robot(2, joints=4)
    base = find_base_parameters(robot)
    fit = knowledge(robot, base, 2, 0.1)
    uncertainty = inertia_uncertainty(SPEC, robot, base, fit)
    inside = points_inside(uncertainty, robot, fit, np.random.default_rng(0))
    states = standing_slowly(robot, 2)
    plant = WholePlant(robot)
    prior = build_constraints(ALL, robot, admitted(robot, False))
    for constraint, wide in zip(build_constraints(ALL, robot, uncertainty), prior, strict=True):
        margins = constraint.margins(states)
        found = np.array([by_mujoco(constraint, plant, phi, states) for phi in inside])
        assert np.all(margins <= found.min(axis=0) + 1e-9)
        if isinstance(constraint, JointTorque):
            slack = by_mujoco(constraint, plant, whole_parameters(robot), states) - margins
            assert slack.sum() < 0.6 * (slack + margins - wide.margins(states)).sum()


def points_inside(
    uncertainty: InertiaUncertainty, robot: Robot, fit: object, rng: np.random.Generator
) -> Array:
    """φ (K, P) in the box, moved to the ellipsoid's surface or inside; those within both."""
    phi, reach = whole_parameters(robot), uncertainty.pieces[0].corners
    base = find_base_parameters(robot)
    mapping = np.hstack([np.zeros((base.rank, 10)), base.mapping])
    spread = np.square(reach)[:, None] * mapping.T
    gain = np.linalg.solve(mapping @ spread, spread.T).T
    root = np.linalg.cholesky(fit.covariance)  # type: ignore[attr-defined]
    found = []
    for _ in range(400):
        direction = rng.normal(size=base.rank)
        goal = fit.values + SPEC.sigmas * root @ direction / np.linalg.norm(direction)  # type: ignore[attr-defined]
        point = phi + 0.5 * rng.uniform(-reach, reach)
        point = point + gain @ (goal - mapping @ point)
        if np.all(np.abs(point - phi) <= reach * (1 + 1e-9)):
            found.append(point)
    assert len(found) > 20
    return np.array(found)


def test_no_uncertainty_gives_the_plain_margins() -> None:
    robot = random_robot(1, joints=4, floating=True)
    states = drawn_states(robot)
    exact = SPEC.model_copy(update={"mass": 0.0, "center_of_mass": 0.0, "inertia": 0.0})
    robust = build_constraints(
        ALL, robot, inertia_uncertainty(exact, robot, find_base_parameters(robot))
    )
    for plain, other in zip(build_constraints(ALL, robot), robust, strict=True):
        assert plain.labels == other.labels
        assert np.allclose(plain.margins(states), other.margins(states), rtol=1e-9, atol=1e-9)


def test_a_robot_that_may_weigh_nothing_is_not_balanced_by_division() -> None:
    robot = random_robot(1, joints=2)
    weightless = SPEC.model_copy(update={"mass": 1.0})
    uncertainty = inertia_uncertainty(weightless, robot, find_base_parameters(robot))
    for constraint in build_constraints(ALL, robot, uncertainty):
        margins = constraint.margins(drawn_states(robot))
        assert np.all(np.isfinite(margins))
        if constraint.name in ("balance", "zmp"):
            assert np.all(margins < 0.1)


@cache
def planned(robust: bool) -> tuple[Problem, Array]:
    settings = ["constraints.torque.scale=0.25", "optimizer.max_iterations=60"]
    settings += ["constraints.self_collision=null", "sequence.motions=1", "optimizer.certify=false"]
    settings += ["uncertainty={mass: 0.2, center_of_mass: 0.01, inertia: 0.2}"] if robust else []
    problem = smoke(*settings)
    return problem, one_motion(problem).coefficients


def overload(robust: bool) -> float:
    """Largest torque over its limit at 500 Hz, over corners of the box and a heavier robot."""
    problem, coefficients = planned(robust)
    judge = planned(True)[0]
    robot = problem.robot
    assert judge.spec.uncertainty is not None
    phi, reach = whole_parameters(robot), box(judge.spec.uncertainty, robot)
    states = problem.states(coefficients, problem.trajectory.basis(np.arange(0, 6, 0.002)))
    rng = np.random.default_rng(0)
    robots = [1.2 * phi, *(phi + rng.choice([-1.0, 1.0], (30, len(phi))) * reach)]
    limits = 0.25 * robot.limits.effort
    torques = [RigidBody(robot, one[10:], states.q, states.v, states.a).load for one in robots]
    return float(np.max([np.abs(torque) / limits for torque in torques]))


@pytest.mark.long
def test_a_robust_motion_keeps_its_torque_on_every_robot_and_a_plain_one_does_not() -> None:
    assert overload(robust=True) < 1.0
    assert overload(robust=False) > 1.0


def test_a_disc_too_small_for_the_uncertainty_leaves_no_room() -> None:
    robot = random_robot(3, joints=3)
    spec = ConstraintsSpec(joint_limits=None, balance=DiscSpec(radius=0.001))
    (disc,) = build_constraints(spec, robot, admitted(robot, False))
    still = np.zeros((1, robot.n))
    states = replace(drawn_states(robot), q=robot.posture[None], v=still, a=still)
    assert disc.margins(states).max() < 0


def test_a_fit_must_be_read_first() -> None:
    with pytest.raises(ConfigError, match=r"uncertainty.fit: fit.h5 was not read"):
        build_problem(load_spec(CONFIG, ["uncertainty={fit: fit.h5}"]), CONFIG.parent)
