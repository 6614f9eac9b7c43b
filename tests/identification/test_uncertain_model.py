"""Models drawn from a covariance: its moments where all exist, and only those that exist."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.pseudo_inertia import (
    InertialPrior,
    body_lengths,
    inertial_prior,
    smallest_eigenvalues,
)
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.errors import ConfigError
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.uncertain_model import (
    UncertainModel,
    from_covariance,
    from_information,
    uncertain,
)
from excite_cli.robot.model import Array, Robot
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(4, joints=3)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


@pytest.fixture(scope="module")
def prior(robot: Robot) -> InertialPrior:
    return inertial_prior(robot, standard_parameters(robot), 0.3)


def spd(size: int, scale: float) -> Array:
    a = np.random.default_rng(0).normal(size=(size, size))
    return scale**2 * (a @ a.T / size + np.eye(size))


def model_of(robot: Robot, root: Array, friction: float, phi: Array) -> UncertainModel:
    count = len(root) - len(phi)
    model = IdentifiedModel(phi, (CoulombFriction((0,)),)[:count], np.full(count, friction))
    center = np.concatenate([phi, model.values])
    return uncertain(
        model,
        center,
        root,
        np.zeros((len(phi), count)),
        body_lengths(robot, standard_parameters(robot)),
        np.ones(count, bool),
    )


def test_base_parameters_have_the_covariance_and_the_rest_that_of_the_prior(
    base: BaseParameters, prior: InertialPrior
) -> None:
    count, rank = len(prior.std), base.rank
    covariance = spd(rank + 1, 0.05)
    root = from_covariance(base, prior, covariance)
    seen = np.zeros((rank + 1, count + 1))
    seen[:rank, :count], seen[rank, count] = base.mapping, 1.0
    whole = root @ root.T
    np.testing.assert_allclose(seen @ whole @ seen.T, covariance, atol=1e-12)
    hidden = np.linalg.svd(base.mapping)[2][rank:]  # of these no torque says anything
    still = np.linalg.inv(np.diag(1.0 / np.square(prior.std)))
    gain = still @ base.mapping.T @ np.linalg.inv(base.mapping @ still @ base.mapping.T)
    given = still - gain @ base.mapping @ still
    rest = whole[:count, :count] - gain @ covariance[:rank, :rank] @ gain.T
    np.testing.assert_allclose(hidden @ rest @ hidden.T, hidden @ given @ hidden.T, atol=1e-9)


def test_what_data_do_not_show_is_as_in_the_prior(
    base: BaseParameters, prior: InertialPrior
) -> None:
    covariance = spd(base.rank + 1, 0.05)
    covariance[0, :], covariance[:, 0] = 0.0, 0.0
    covariance[0, 0] = covariance[-1, -1] = np.inf
    root = from_covariance(base, prior, covariance)
    assert np.isfinite(root).all()
    assert not root[-1].any(), "an effect that is not seen stays as it is"
    found = base.mapping[0] @ root[:-1]
    assert found @ found == pytest.approx(prior.base_std(base)[0] ** 2)


def test_information_and_prior_add_up(base: BaseParameters, prior: InertialPrior) -> None:
    size, count = base.rank + 1, len(prior.std)
    factor = np.linalg.cholesky(spd(size, 3.0)).T
    root = from_information(base, prior, factor)
    seen = np.zeros((size, count + 1))
    seen[: base.rank, :count], seen[base.rank, count] = base.mapping, 1.0
    information = seen.T @ factor.T @ factor @ seen
    information[:count, :count] += np.diag(1.0 / np.square(prior.std))
    np.testing.assert_allclose(np.linalg.inv(root @ root.T), information, rtol=1e-5, atol=1e-5)


def test_where_all_exist_draws_have_the_covariance(robot: Robot, prior: InertialPrior) -> None:
    phi = standard_parameters(robot)
    root = np.diag(np.append(1e-3 * prior.std, 1e-3))
    found = model_of(robot, root, 1.0, phi).drawn(150, seed=3)
    z = (found - np.append(phi, 1.0)) / np.append(1e-3 * prior.std, 1e-3)
    assert abs(z.mean()) < 0.05
    assert z.std() == pytest.approx(1.0, abs=0.05)
    again = model_of(robot, root, 1.0, phi).drawn(2, seed=3)
    assert np.array_equal(again, found[:2])
    assert not np.array_equal(model_of(robot, root, 1.0, phi).drawn(1, seed=4)[0], found[0])


def test_what_cannot_be_is_not_drawn_and_nothing_lies_at_the_border(robot: Robot) -> None:
    """A friction of zero gets the half of a normal distribution."""
    phi = standard_parameters(robot)
    root = np.zeros((len(phi) + 1, 1))
    root[-1] = 0.2
    friction = model_of(robot, root, 0.0, phi).drawn(300, seed=1)[:, -1]
    assert friction.min() > 0.0
    assert friction.mean() == pytest.approx(0.2 * np.sqrt(2 / np.pi), rel=0.15)
    assert np.mean(friction < 0.02) < 0.15


def test_bodies_are_mass_distributions(robot: Robot, prior: InertialPrior) -> None:
    phi = standard_parameters(robot)
    wide = model_of(robot, np.diag(np.append(prior.std, 0.1)), 1.0, phi)
    drawn = wide.drawn(30, seed=1)
    free = np.append(phi, 1.0) + np.random.default_rng(0).normal(size=drawn.shape) * np.append(
        prior.std, 0.1
    )
    lengths = wide.lengths
    assert all(smallest_eigenvalues(x[:-1], lengths).min() > 0.0 for x in drawn)
    assert not all(smallest_eigenvalues(x[:-1], lengths).min() > 0.0 for x in free)


def test_a_model_that_cannot_be_is_moved_or_refused(robot: Robot, prior: InertialPrior) -> None:
    phi = standard_parameters(robot)
    phi[4] = -abs(phi[4])  # the first body's Ixx
    root = np.diag(np.append(prior.std, 0.1))
    moved = model_of(robot, root, 1.0, phi)
    assert moved.exists(moved.numbers)
    assert not moved.exists(moved.center)
    with pytest.raises(ConfigError, match=r"no robot near the model .* identification\.consistent"):
        model_of(robot, np.zeros((len(phi) + 1, 1)), 1.0, phi)


def test_what_is_carried_is_part_of_a_body(robot: Robot, prior: InertialPrior) -> None:
    phi = standard_parameters(robot)
    found = model_of(robot, np.diag(np.append(prior.std, 0.1)), 1.0, phi)
    carry = np.zeros((len(phi), 1))
    carry[0] = -2.0 * phi[0]
    assert not replace(found, carry=carry).exists(found.numbers)
