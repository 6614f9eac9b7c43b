"""Viscous and Coulomb friction as on a data sheet: a line through all friction of a joint."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.data_sheet_line import data_sheet_lines
from excite_cli.diagnosis.final_fit import FinalFit
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.load_dependent_friction import LoadDependentFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.spring import Spring
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.robot.model import Array, Robot
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

SAMPLES, BEFORE = 400, 3  # parameters of the inertias come first
ROOT = {"power": 0.5}


class Run(SimpleNamespace):
    """A prepared run that filters nothing."""

    def averaged_for_fit(self, columns: Array, rows: Any = None) -> Array:
        return columns


@pytest.fixture(scope="module", params=[False, True], ids=["turning", "sliding"])
def robot(request: pytest.FixtureRequest) -> Robot:
    chosen = (random_robot(seed, joints=3, branches=False) for seed in range(100))
    return next(each for each in chosen if bool(each.sliding[1]) == request.param)


def lines(robot: Robot, declared: list[Effect], found: list[Effect], values: list[float]) -> Any:
    """And the joint's speeds (T,) and loads that count."""
    signals = signals_of(robot, SAMPLES)
    usable = np.abs(signals.v) > 0.1
    traced: Any = SimpleNamespace(
        model=SimpleNamespace(robot=robot, declared=tuple(declared)),
        effects=tuple(found),
        signals=(signals,),
        data=SimpleNamespace(runs=(Run(usable=usable),)),
    )
    parameters = np.array([*np.ones(BEFORE), *values])
    spread = np.diag(np.arange(1.0, len(parameters) + 1)) * 1e-4
    told = data_sheet_lines(traced, FinalFit(parameters, spread, np.ones(len(parameters), bool)))
    return told, signals.v[usable[:, 1], 1], signals.load[usable[:, 1], 1], spread


def test_it_is_the_fit_of_a_line_to_all_friction_declared_and_found(robot: Robot) -> None:
    declared = [ViscousFriction((0,)), CoulombFriction((1,))]
    found: list[Effect] = [
        NonlinearViscousFriction((1,), ROOT), Spring((1,)), LoadDependentFriction((1,)),
    ]  # fmt: skip
    told, v, load, spread = lines(robot, declared, found, [7.0, -0.5, 3.0, 9.0, 1.0, 0.2])
    plain, curved = told
    assert (plain.joint, curved.joint) == (robot.joint_names[0], robot.joint_names[1])
    assert not plain.curved
    assert (plain.viscous.value, plain.coulomb.value) == pytest.approx((7.0, 0.0), abs=1e-9)
    friction = np.stack(
        [np.sign(v), np.sign(v) * np.sqrt(np.abs(v)), np.abs(load) * np.sign(v)], axis=1
    )
    straight = np.stack([v, np.sign(v)], axis=1)
    slopes = np.linalg.lstsq(straight, friction, rcond=None)[0]
    expected = slopes @ [-0.5, 3.0, 0.2]
    assert curved.curved
    assert (curved.viscous.value, curved.coulomb.value) == pytest.approx(expected, rel=1e-3)
    at = [BEFORE + 1, BEFORE + 2, BEFORE + 5]
    deviations = np.sqrt(np.diag(slopes @ spread[np.ix_(at, at)] @ slopes.T))
    assert (curved.viscous.std, curved.coulomb.std) == pytest.approx(deviations, rel=1e-3)
    slides = bool(robot.sliding[1])
    assert curved.viscous.unit == ("N·s/m" if slides else "N·m·s/rad")
    assert curved.coulomb.unit == ("N" if slides else "N·m")
    # Friction of single runs is no plain line.
    alone = CoulombFriction((1,), {}, ("of_another",))
    (line,), *_ = lines(robot, [CoulombFriction((1,))], [alone], [2.0, 5.0])
    assert line.curved
    assert line.coulomb.value == pytest.approx(2.0)
