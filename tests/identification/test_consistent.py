from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.pseudo_inertia import (
    BASIS,
    body_lengths,
    pseudo_inertias,
    smallest_eigenvalues,
)
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.identification.consistent import ConsistentParameters, consistent_parameters
from excite_cli.identification.prior import InertialPrior, inertial_prior
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import true_inertias
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(4, joints=4)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


def factor_of(
    robot: Robot, base: BaseParameters, phi: Array, noise: float, friction: Array, seed: int = 1
) -> Array:
    """R of [base columns, sign of every speed, torque], in units of the noise."""
    rng = np.random.default_rng(seed)
    q, v, a = robot.draw_states(100, seed)
    y = Regressor(robot).evaluate(q, v, a)
    sign = np.sign(v)[:, :, None] * np.eye(robot.n)
    tau = y @ phi + sign @ friction
    tau = tau + noise * rng.normal(size=tau.shape)
    rows = np.concatenate([y[:, :, base.selection], sign, tau[..., None]], axis=2)
    return np.linalg.qr(rows.reshape(-1, rows.shape[2]) / max(noise, 1e-3), mode="r")


def solved(
    robot: Robot, base: BaseParameters, factor: Array, cad: Array, spread: float = 1.0
) -> ConsistentParameters:
    signs = np.ones(robot.n, bool)
    lengths = body_lengths(robot, cad)
    prior = inertial_prior(robot, cad, spread)
    return consistent_parameters(factor, base, prior, lengths, signs)


def test_planted_consistent_parameters_are_recovered(robot: Robot, base: BaseParameters) -> None:
    phi = true_inertias(robot, 0.2, seed=3)
    friction = np.array([1.0, 0.5, 2.0, 0.1])
    found = solved(
        robot, base, factor_of(robot, base, phi, 0.0, friction), standard_parameters(robot)
    )
    assert found.solved
    expected = base.mapping @ phi
    assert base.mapping @ found.phi == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())
    assert found.effects == pytest.approx(friction, abs=1e-3)
    assert found.eigenvalues.min() > 0


@pytest.mark.parametrize("noise", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_the_noise_bodies_are_real(
    robot: Robot, base: BaseParameters, noise: float, seed: int
) -> None:
    phi = true_inertias(robot, 0.2, seed=3)
    friction = np.array([0.1, 0.0, 0.2, 0.0])
    factor = factor_of(robot, base, phi, noise, friction, seed)
    found = solved(robot, base, factor, standard_parameters(robot))
    assert found.solved
    eigenvalues = np.linalg.eigvalsh(pseudo_inertias(found.phi))
    assert eigenvalues.min() > 0
    assert found.effects.min() >= 0
    assert found.cost >= -1e-6


def test_without_constraints_parameters_would_be_impossible(
    robot: Robot, base: BaseParameters
) -> None:
    """The other half of the test above: this much noise does break the free fit."""
    phi = true_inertias(robot, 0.2, seed=3)
    factor = factor_of(robot, base, phi, 30.0, np.zeros(4))
    cad = standard_parameters(robot)
    free = np.linalg.lstsq(factor[:-1, :-1], factor[:-1, -1], rcond=None)[0]
    completed = inertial_prior(robot, cad, 1.0).completed(base, free[: base.rank])
    assert smallest_eigenvalues(completed, body_lengths(robot, cad)).min() < 0


def test_inertias_of_the_urdf_that_are_impossible_do_no_harm(
    robot: Robot, base: BaseParameters
) -> None:
    """A point mass away from its joint, and a body without any mass."""
    phi = true_inertias(robot, 0.2, seed=3)
    cad = standard_parameters(robot).copy()
    cad[-6:] = 0.0
    cad[10:20] = 0.0
    assert smallest_eigenvalues(cad, np.ones(robot.n_bodies)).min() < 0
    found = solved(robot, base, factor_of(robot, base, phi, 0.1, np.zeros(4)), cad)
    assert found.solved
    assert found.eigenvalues.min() > 0
    # In torques: a single base parameter depends on which column stands for its group.
    y = Regressor(robot).evaluate(*robot.draw_states(200, 9))
    wrong = np.linalg.norm(y @ (found.phi - phi)) / np.linalg.norm(y @ phi)
    assert wrong < 0.04


def single_body() -> tuple[BaseParameters, InertialPrior, Array]:
    """All ten parameters of one body seen directly, at values that no body has."""
    identity = BaseParameters(np.arange(10), np.eye(10), tuple("abcdefghij"), 0.0, 1.0)
    mean = np.array([1.0, 0.1, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1])
    prior = InertialPrior(mean, np.full(10, 100.0))
    wanted = np.array([0.5, 0.6, 0.1, -0.2, 0.1, 0.02, 0.3, 0.0, 0.01, 0.1])
    return identity, prior, wanted


def test_against_another_method_on_one_body() -> None:
    """J = L Lᵀ with L lower triangular, minimised without constraints by BFGS."""
    identity, prior, wanted = single_body()
    weights = np.diag([1.0, 2.0, 3.0, 1.0, 5.0, 1.0, 2.0, 4.0, 1.0, 3.0])
    factor = np.zeros((11, 11))
    factor[:10, :10], factor[:10, 10] = weights, weights @ wanted
    found = consistent_parameters(factor, identity, prior, np.ones(1), np.zeros(0, bool))
    lower = np.tril_indices(4)

    def phi_of(x: Array) -> Array:
        root = np.zeros((4, 4))
        root[lower] = x
        j = root @ root.T
        second, inertia = j[:3, :3], np.trace(j[:3, :3]) * np.eye(3) - j[:3, :3]
        del second
        moments = [inertia[r, c] for r, c in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
        return np.concatenate([[j[3, 3]], j[:3, 3], moments])

    def cost(x: Array) -> float:
        return float(np.square(weights @ (phi_of(x) - wanted)).sum())

    rng = np.random.default_rng(0)
    tries = [minimize(cost, rng.normal(size=10) * 0.5, options={"gtol": 1e-10}) for _ in range(6)]
    best = min(tries, key=lambda result: result.fun)
    assert best.fun > 0.01  # the constraint is active
    assert found.cost == pytest.approx(best.fun, rel=1e-3)
    assert found.phi == pytest.approx(phi_of(best.x), abs=3e-3)


def test_the_pseudo_inertia_of_point_masses() -> None:
    """J = Σ m [p; 1][p; 1]ᵀ, and its ten parameters from the definition."""
    rng = np.random.default_rng(0)
    points, masses = rng.normal(size=(5, 3)), rng.uniform(0.1, 1, 5)
    inertia = sum(
        m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True)
    )
    moments = [inertia[r, c] for r, c in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    phi = np.concatenate([[masses.sum()], masses @ points, moments])
    homogeneous = np.column_stack([points, np.ones(5)])
    expected = (homogeneous.T * masses) @ homogeneous
    assert pseudo_inertias(phi)[0] == pytest.approx(expected)
    assert BASIS.shape == (10, 4, 4)


def test_the_kuka_whose_urdf_has_an_impossible_wrist(kr300: Path) -> None:
    from excite_cli.config.robot_spec import RobotSpec
    from excite_cli.robot.model import build_robot

    robot = build_robot(RobotSpec(urdf=str(kr300 / "kr300.urdf")))
    cad = standard_parameters(robot)
    assert smallest_eigenvalues(cad, np.ones(robot.n_bodies)).min() < 1e-9
    base = find_base_parameters(robot)
    factor = factor_of(robot, base, cad, 10.0, np.full(6, 100.0))
    found = solved(robot, base, factor, cad, 0.1)
    assert found.solved
    assert found.eigenvalues.min() > 0
