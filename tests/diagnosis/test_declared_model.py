"""Full inertias that go with a fit: nearest to the URDF's, or the URDF's with a change."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space

from excite_cli.diagnosis.declared_model import KeptInertias, Model, width_of
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.effects.catalogue import catalogue
from excite_cli.identification.prior import inertial_prior
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def model() -> Model:
    robot = random_robot(4, joints=3, branches=False)
    return Model(robot, find_base_parameters(robot), (), None)


def test_the_fit_and_its_inertias_give_the_same_torque(model: Model) -> None:
    """Parameters of effects follow the inertial ones and do not matter."""
    base, robot = model.base, model.robot
    fitted = np.random.default_rng(1).normal(size=base.rank)
    phi = model.full_inertias(np.concatenate([fitted, [1e6, -1e6]]))
    assert np.array_equal(phi, model.full_inertias(fitted))
    y = Regressor(robot).evaluate(*robot.draw_states(20, 5))
    assert y @ phi == pytest.approx(y[..., base.selection] @ fitted, abs=1e-8)


def test_of_all_inertias_that_agree_the_nearest_is_taken(model: Model) -> None:
    """Against least squares over all changes that no torque shows."""
    base, robot = model.base, model.robot
    cad = standard_parameters(robot)
    fitted = base.mapping @ cad + np.random.default_rng(2).normal(size=base.rank)
    std = inertial_prior(robot, cad, 1.0).std
    some = np.linalg.lstsq(base.mapping, fitted, rcond=None)[0]
    free = null_space(base.mapping)
    moved = np.linalg.lstsq(free / std[:, None], (cad - some) / std, rcond=None)[0]
    assert model.full_inertias(fitted) == pytest.approx(some + free @ moved, abs=1e-7)


def test_what_the_urdf_says_already_changes_nothing(model: Model) -> None:
    cad = standard_parameters(model.robot)
    assert model.full_inertias(model.base.mapping @ cad) == pytest.approx(cad, abs=1e-9)


def test_kept_inertias_are_their_mean_and_the_fitted_change(model: Model) -> None:
    """With a prior, all standard parameters are fitted, as changes."""
    rng = np.random.default_rng(3)
    count = 10 * model.robot.n_bodies
    mean, change = rng.normal(size=count), rng.normal(size=count)
    kept = replace(model, prior=KeptInertias(mean, np.ones(count)))
    found = kept.full_inertias(np.concatenate([change, [1e6] * 4]))
    assert found == pytest.approx(mean + change)


def test_widths_are_those_of_linear_parameters(model: Model) -> None:
    effects = tuple(catalogue()[kind]((0,)) for kind in ("spring", "armature", "payload"))
    assert width_of(effects) == 2 + 1 + 10
    assert replace(model, declared=effects).declared_width == 13
    assert model.declared_width == 0


@pytest.mark.parametrize("kept", [False, True])
def test_what_was_weighed_is_said_of_the_columns_that_are_fitted(model: Model, kept: bool) -> None:
    """It is as far from any φ, whether base parameters are fitted or changes of all inertias."""
    rng = np.random.default_rng(6)
    count, effects = 10 * model.robot.n_bodies, (catalogue()["spring"]((0,)),)
    mean, change, own = rng.normal(size=count), rng.normal(size=count), rng.normal(size=2)
    rows = rng.normal(size=(3, model.base.rank + 2 + 1))
    prior = KeptInertias(mean, np.ones(count)) if kept else None
    known = replace(model, declared=effects, prior=prior, weighed=rows).weighed_columns
    fitted = change if kept else model.base.mapping @ (mean + change)
    missed = rows @ np.concatenate([model.base.mapping @ (mean + change), own, [-1.0]])
    assert known @ np.concatenate([fitted, own, [-1.0]]) == pytest.approx(missed)
    assert replace(model, prior=prior).weighed_columns.shape == (0, len(fitted) + 1)
