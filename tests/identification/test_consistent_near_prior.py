"""Links stay near the URDF where the data are silent, and go where the data ask for it."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec, IdentificationSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.pseudo_inertia import body_lengths
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.identification.consistent import (
    CLEARLY_WORSE,
    ConsistentParameters,
    consistent_near_prior,
    consistent_parameters,
)
from excite_cli.identification.fit import fit
from excite_cli.identification.prior import inertial_prior
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.build import true_inertias
from tests.identification.synthetic import measured, regression_of
from tests.identification.test_consistent import factor_of
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(4, joints=4)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


def both(
    robot: Robot, base: BaseParameters, factor: Array
) -> tuple[ConsistentParameters, ConsistentParameters]:
    """With the prior as it is, and as near to it as the data let."""
    cad = standard_parameters(robot)
    given = (factor, base, inertial_prior(robot, cad, 1.0), body_lengths(robot, cad))
    signs = np.ones(robot.n, bool)
    return consistent_parameters(*given, signs), consistent_near_prior(*given, signs)


def off(robot: Robot, phi: Array, other: Array) -> float:
    std = inertial_prior(robot, standard_parameters(robot), 1.0).std
    return float(np.sqrt(np.mean(np.square((phi - other) / std))))


def test_noise_does_not_move_a_robot_that_is_as_its_urdf_says(
    robot: Robot, base: BaseParameters
) -> None:
    cad = standard_parameters(robot)
    wide, near = both(robot, base, factor_of(robot, base, cad, 10.0, np.ones(4)))
    assert near.spread < 0.2
    assert off(robot, near.phi, cad) < 0.4 * off(robot, wide.phi, cad)
    assert near.cost <= wide.cost + CLEARLY_WORSE


def test_what_the_data_show_is_followed(robot: Robot, base: BaseParameters) -> None:
    """Every base parameter is as far from the truth as the noise makes it, not the URDF."""
    truth = true_inertias(robot, 0.4, seed=3)
    cad = standard_parameters(robot)
    factor = factor_of(robot, base, truth, 0.1, np.ones(4))
    wide, near = both(robot, base, factor)
    assert near.cost <= wide.cost + CLEARLY_WORSE
    moved = np.abs(base.mapping @ (truth - cad)).max()
    assert np.abs(base.mapping @ (near.phi - truth)).max() < 0.2 * moved
    assert off(robot, near.phi, truth) < 1.1 * off(robot, wide.phi, truth)


def test_a_link_of_the_kuka_that_the_data_do_not_determine_stays_near_its_urdf(
    kr300: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Friction and armature declared, the spring is not: axis_3 went from 105 kg to 12 kg."""
    robot = build_robot(RobotSpec(urdf=str(kr300 / "kr300.urdf")))
    with h5py.File(kr300 / "kr300.h5") as file:
        runs = tuple(
            Run(name, group["t"][()], group["q"][()], group["tau"][()])
            for name, group in file["runs"].items()
        )
    data = Dataset(robot.joint_names, runs)
    kinds = ("viscous_friction", "coulomb_friction", "armature")
    effects = declared_effects([EffectSpec(kind=kind) for kind in kinds], robot)
    regression = regression_of(robot, data, effects)
    near = fit(regression, IdentificationSpec()).consistent
    monkeypatch.setattr(
        "excite_cli.identification.fit.consistent_near_prior", consistent_parameters
    )
    wide = fit(regression, IdentificationSpec()).consistent
    assert near is not None
    assert wide is not None
    given = standard_parameters(robot)[20]
    assert wide.phi[20] < given / 3
    assert given / 2 < near.phi[20] < 2 * given
    assert near.cost <= wide.cost + CLEARLY_WORSE


def test_the_users_own_uncertainty_is_left_alone(robot: Robot) -> None:
    cad = standard_parameters(robot)
    data = measured(robot, cad, noise=1.0, seconds=4.0)
    regression = regression_of(robot, data)
    spreads = []
    for inertias in ("free", "cad"):
        found = fit(regression, IdentificationSpec(inertias=inertias)).consistent
        assert found is not None
        spreads.append(found.spread)
    assert spreads[0] < 1.0
    assert spreads[1] == 1.0
