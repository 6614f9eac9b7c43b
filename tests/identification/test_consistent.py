"""Inertias that real bodies can have, near the URDF where the data are silent."""

import numpy as np
import pytest
from scipy.optimize import minimize

from excite_cli.config.data_spec import EffectSpec, IdentificationSpec
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.pseudo_inertia import (
    BASIS,
    InertialPrior,
    body_lengths,
    inertial_prior,
    pseudo_inertias,
    smallest_eigenvalues,
)
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.identification.consistent import (
    CLEARLY_WORSE,
    ConsistentParameters,
    consistent_near_prior,
    consistent_parameters,
)
from excite_cli.identification.fit import fit
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import true_inertias
from tests.identification.synthetic import measured, regression_of
from tests.robot.random_robots import random_robot

ROBOT = random_robot(4, joints=4)
BASE = find_base_parameters(ROBOT)
CAD = standard_parameters(ROBOT)


def factor_of(phi: Array, noise: float, friction: Array, seed: int = 1) -> Array:
    """R of [base columns, sign of every speed, torque], in units of the noise."""
    rng = np.random.default_rng(seed)
    q, v, a = ROBOT.draw_states(100, seed)
    y = Regressor(ROBOT).evaluate(q, v, a)
    sign = np.sign(v)[:, :, None] * np.eye(ROBOT.n)
    tau = y @ phi + sign @ friction
    tau = tau + noise * rng.normal(size=tau.shape)
    rows = np.concatenate([y[:, :, BASE.selection], sign, tau[..., None]], axis=2)
    return np.linalg.qr(rows.reshape(-1, rows.shape[2]) / max(noise, 1e-3), mode="r")


def solved(factor: Array, cad: Array, spread: float = 1.0) -> ConsistentParameters:
    signs = np.ones(ROBOT.n, bool)
    lengths = body_lengths(ROBOT, cad)
    prior = inertial_prior(ROBOT, cad, spread)
    return consistent_parameters(factor, BASE, prior, lengths, signs)


def test_planted_consistent_parameters_are_recovered() -> None:
    phi = true_inertias(ROBOT, 0.2, seed=3)
    friction = np.array([1.0, 0.5, 2.0, 0.1])
    found = solved(factor_of(phi, 0.0, friction), CAD)
    assert found.solved
    expected = BASE.mapping @ phi
    assert BASE.mapping @ found.phi == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())
    assert found.effects == pytest.approx(friction, abs=1e-3)
    assert found.eigenvalues.min() > 0


@pytest.mark.parametrize("noise", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_the_noise_bodies_are_real(noise: float, seed: int) -> None:
    phi = true_inertias(ROBOT, 0.2, seed=3)
    friction = np.array([0.1, 0.0, 0.2, 0.0])
    factor = factor_of(phi, noise, friction, seed)
    found = solved(factor, CAD)
    assert found.solved
    eigenvalues = np.linalg.eigvalsh(pseudo_inertias(found.phi))
    assert eigenvalues.min() > 0
    assert found.effects.min() >= 0
    assert found.cost >= -1e-6
    if noise == 30.0:  # this much does break the fit without constraints
        free = np.linalg.lstsq(factor[:-1, :-1], factor[:-1, -1], rcond=None)[0]
        completed = inertial_prior(ROBOT, CAD, 1.0).completed(BASE, free[: BASE.rank])
        assert smallest_eigenvalues(completed, body_lengths(ROBOT, CAD)).min() < 0


def test_inertias_of_the_urdf_that_are_impossible_do_no_harm() -> None:
    """A point mass away from its joint, and a body without any mass."""
    phi = true_inertias(ROBOT, 0.2, seed=3)
    cad = CAD.copy()
    cad[-6:] = 0.0
    cad[10:20] = 0.0
    assert smallest_eigenvalues(cad, np.ones(ROBOT.n_bodies)).min() < 0
    found = solved(factor_of(phi, 0.1, np.zeros(4)), cad)
    assert found.solved
    assert found.eigenvalues.min() > 0
    # In torques: a single base parameter depends on which column stands for its group.
    y = Regressor(ROBOT).evaluate(*ROBOT.draw_states(200, 9))
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


def both(factor: Array) -> tuple[ConsistentParameters, ConsistentParameters]:
    """With the prior as it is, and as near to it as the data let."""
    given = (factor, BASE, inertial_prior(ROBOT, CAD, 1.0), body_lengths(ROBOT, CAD))
    signs = np.ones(ROBOT.n, bool)
    return consistent_parameters(*given, signs), consistent_near_prior(*given, signs)


def off(phi: Array, other: Array) -> float:
    std = inertial_prior(ROBOT, CAD, 1.0).std
    return float(np.sqrt(np.mean(np.square((phi - other) / std))))


def test_noise_does_not_move_a_robot_that_is_as_its_urdf_says() -> None:
    wide, near = both(factor_of(CAD, 10.0, np.ones(4)))
    assert near.spread < 0.2
    assert off(near.phi, CAD) < 0.4 * off(wide.phi, CAD)
    assert near.cost <= wide.cost + CLEARLY_WORSE


def test_what_the_data_show_is_followed() -> None:
    """Every base parameter is as far from the truth as the noise makes it, not the URDF."""
    truth = true_inertias(ROBOT, 0.4, seed=3)
    factor = factor_of(truth, 0.1, np.ones(4))
    wide, near = both(factor)
    assert near.cost <= wide.cost + CLEARLY_WORSE
    moved = np.abs(BASE.mapping @ (truth - CAD)).max()
    assert np.abs(BASE.mapping @ (near.phi - truth)).max() < 0.2 * moved
    assert off(near.phi, truth) < 1.1 * off(wide.phi, truth)


def test_a_link_of_the_kuka_that_the_data_do_not_determine_stays_near_its_urdf(
    kr300: tuple[Robot, Dataset], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Friction and armature declared, the spring is not: axis_3 went from 105 kg to 12 kg."""
    robot, data = kr300
    kinds = ("viscous_friction", "coulomb_friction", "armature")
    effects = declared_effects([EffectSpec(kind=kind) for kind in kinds], robot)
    regression = regression_of(robot, data, effects)
    near = fit(regression, IdentificationSpec()).consistent
    module = "excite_cli.identification.fit"
    monkeypatch.setattr(f"{module}.consistent_near_prior", consistent_parameters)
    wide = fit(regression, IdentificationSpec()).consistent
    assert near is not None
    assert wide is not None
    given = standard_parameters(robot)[20]
    assert wide.phi[20] < given / 3
    assert given / 2 < near.phi[20] < 2 * given
    assert near.cost <= wide.cost + CLEARLY_WORSE


def test_the_users_own_uncertainty_is_left_alone() -> None:
    data = measured(ROBOT, CAD, noise=1.0, seconds=4.0)
    regression = regression_of(ROBOT, data)
    spreads = []
    for inertias in ("free", "cad"):
        found = fit(regression, IdentificationSpec(inertias=inertias)).consistent
        assert found is not None
        spreads.append(found.spread)
    assert spreads[0] < 1.0
    assert spreads[1] == 1.0
