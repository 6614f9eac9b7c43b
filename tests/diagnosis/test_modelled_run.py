"""Full inertias that go with a fit: nearest to the URDF's, or the URDF's with a change."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space

from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.pseudo_inertia import inertial_prior
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.effects.catalogue import catalogue
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def model() -> DeclaredModel:
    robot = random_robot(4, joints=3, branches=False)
    return DeclaredModel(robot, find_base_parameters(robot), (), None)


def test_of_all_inertias_that_agree_the_nearest_is_taken(model: DeclaredModel) -> None:
    """Parameters of effects follow the inertial ones and do not matter."""
    base, robot = model.base, model.robot
    fitted = np.random.default_rng(1).normal(size=base.rank)
    phi = model.full_inertias(np.concatenate([fitted, [1e6, -1e6]]))
    assert np.array_equal(phi, model.full_inertias(fitted))
    y = Regressor(robot).evaluate(*robot.draw_states(20, 5))
    assert y @ phi == pytest.approx(y[..., base.selection] @ fitted, abs=1e-8)
    # Of all inertias that agree the nearest is taken. Against least squares over all changes that
    # no torque shows.
    cad = standard_parameters(robot)
    fitted = base.mapping @ cad + np.random.default_rng(2).normal(size=base.rank)
    std = inertial_prior(robot, cad, 1.0).std
    some = np.linalg.lstsq(base.mapping, fitted, rcond=None)[0]
    free = null_space(base.mapping)
    moved = np.linalg.lstsq(free / std[:, None], (cad - some) / std, rcond=None)[0]
    assert model.full_inertias(fitted) == pytest.approx(some + free @ moved, abs=1e-7)
    assert model.full_inertias(base.mapping @ cad) == pytest.approx(cad, abs=1e-9)


@pytest.mark.parametrize("kept", [False, True])
def test_what_is_known_is_what_scales_say_and_the_urdf(model: DeclaredModel, kept: bool) -> None:
    rng = np.random.default_rng(6)
    effects, base = (catalogue()["spring"]((0,)),), model.base
    weighed = rng.normal(size=(3, base.rank + 2 + 1))
    cad = standard_parameters(model.robot)
    prior = inertial_prior(model.robot, cad, 0.3) if kept else None
    known = replace(model, declared=effects, prior=prior, weighed=weighed)
    assert known.is_weighed
    assert known.known[:3] == pytest.approx(weighed)
    assert len(known.known) == 3 + kept * base.rank
    # The prior's rows are zero at the URDF, whatever the spring is.
    at_urdf = np.concatenate([base.mapping @ cad, rng.normal(size=2), [-1.0]])
    assert known.known[3:] @ at_urdf == pytest.approx(0.0, abs=1e-9)
    bare = replace(model, prior=prior)
    assert not bare.is_weighed
    assert bare.scales.shape == (0, base.rank + 1)
    assert bare.known.shape == (kept * base.rank, base.rank + 1)
    assert bare.by_urdf == pytest.approx(base.mapping @ cad)
