from typing import Literal

import numpy as np
import pytest

from excite_cli.config.data_spec import IdentificationSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.pseudo_inertia import inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification.prior import prior_of
from excite_cli.robot.model import build_robot
from tests.robot.random_robots import random_robot

ROBOT = random_robot(2, joints=4)
BASE = find_base_parameters(ROBOT)


def test_on_base_parameters_it_is_the_prior_on_all_parameters() -> None:
    """Data and prior on φ (all of it) against data and prior on φ_B: the same φ_B, the same φ."""
    rng = np.random.default_rng(1)
    cad = standard_parameters(ROBOT)
    prior = inertial_prior(ROBOT, cad, 0.1)
    of_base = rng.normal(size=(30, BASE.rank))
    measured = of_base @ (BASE.mapping @ cad * 1.3) + rng.normal(size=30)
    full = np.vstack([of_base @ BASE.mapping, np.diag(1 / prior.std)])
    phi = np.linalg.lstsq(full, np.concatenate([measured, cad / prior.std]), rcond=None)[0]
    rows, target = prior.on_base(BASE)
    short = np.linalg.lstsq(
        np.vstack([of_base, rows]), np.concatenate([measured, target]), rcond=None
    )[0]
    assert short == pytest.approx(BASE.mapping @ phi, rel=1e-6, abs=1e-8)
    assert prior.completed(BASE, short) == pytest.approx(phi, rel=1e-6, abs=1e-8)
    # The completed set keeps the base parameters.
    prior = inertial_prior(ROBOT, cad, 1.0)
    values = BASE.mapping @ cad + np.random.default_rng(0).normal(size=BASE.rank)
    assert BASE.mapping @ prior.completed(BASE, values) == pytest.approx(values, abs=1e-12)
    assert prior.completed(BASE, BASE.mapping @ cad) == pytest.approx(cad, abs=1e-9)


def test_zeros_of_the_urdf_may_move_a_little() -> None:
    cad = standard_parameters(ROBOT).copy()
    cad[2] = cad[5] = 0.0
    cad[10:20] = 0.0
    std = inertial_prior(ROBOT, cad, 0.1).std
    assert (std > 0).all()
    assert std[0] == pytest.approx(0.1 * cad[0])
    assert std[2] < 0.1 * cad[0]


@pytest.mark.parametrize("factor", [1.1, 1e4])
def test_a_placeholder_is_worth_what_the_fit_says(factor: float) -> None:
    """Masses a ten-thousandth of the true ones: the prior becomes as wide as they are off."""
    cad = standard_parameters(ROBOT)
    prior = inertial_prior(ROBOT, cad, 0.3)
    truth = BASE.mapping @ (factor * cad)
    wide = prior.widened(BASE, truth)
    if factor < 2:
        assert wide is prior
        return
    whiten, target = wide.on_base(BASE)
    assert np.median(np.abs(whiten @ truth - target)) == pytest.approx(0.6745)
    off = truth.copy()
    off[0] += 1e9  # what one parameter takes up says nothing of the others
    assert np.median(prior.widened(BASE, off).std / wide.std) == pytest.approx(1.0, rel=0.5)


@pytest.mark.parametrize(
    ("body", "times", "wide"), [(5, 20.0, True), (5, 1.3, False), (2, 1.3, False)]
)
def test_a_tool_that_is_not_in_the_urdf_widens_the_last_body(
    body: int, times: float, wide: bool
) -> None:
    """3.5 kg on a wrist of 0.2 kg: nobody knows it, and the rest is as the URDF has it."""
    robot = build_robot(RobotSpec(urdf="example-robot-data:ur10"))
    base, cad = find_base_parameters(robot), standard_parameters(robot)
    prior = inertial_prior(robot, cad, 0.3)
    assert prior.ends == (5,)
    truth = cad.copy()
    truth[10 * body : 10 * body + 10] *= times
    found = prior.widened(base, base.mapping @ truth)
    if not wide:
        assert found is prior
        return
    wider = found.std / prior.std
    assert (wider[50:] > 15.0).all()
    assert (wider[:50] < 3.0).all()


def test_what_the_urdf_is_worth() -> None:
    cad = standard_parameters(ROBOT)

    def share(inertias: Literal["auto", "free", "cad"], weighed: bool = False) -> float | None:
        spec = IdentificationSpec(inertias=inertias, uncertainty=0.07)
        prior = prior_of(spec, ROBOT, weighed)
        return None if prior is None else float(prior.std[0] / cad[0])

    assert share("auto") == pytest.approx(0.3)
    assert share("free") == pytest.approx(1.0)
    assert share("cad") == share("cad", weighed=True) == pytest.approx(0.07)
    assert share("auto", weighed=True) is None
