"""What every kind states of itself is what a diagnosis does with it, kind by kind.

Columns are made up: only the traits of a kind and the energy that it explains matter here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis.candidates import Candidate, possible_effects, shapes_around
from excite_cli.diagnosis.in_runs import SeenRuns
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.search import CandidateSearch
from excite_cli.diagnosis.search_loop import _usual
from excite_cli.effects.base import Effect, Signals, Tier
from excite_cli.effects.catalogue import catalogue
from excite_cli.identification.declared_states import LeftOut
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import TOTAL, anything, effect, on_joint_0, planted
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

ALPHA = 0.01
NO_VETO = Rules(ALPHA, -1.0)
STRAIGHT = ("viscous_friction", "coulomb_friction")
# χ² beyond chance, when it is asked for, and whether noise is measured with it in the model.
STATED: Mapping[str, tuple[float, int, bool]] = {
    "viscous_friction": (0.0, 1, True),
    "nonlinear_viscous_friction": (2.0, 2, True),
    "coulomb_friction": (0.0, 1, True),
    "asymmetric_friction": (4.0, 3, False),
    "stribeck_friction": (2.0, 2, False),
    "load_dependent_friction": (1.0, 2, True),
    "gear_loss": (4.0, 2, False),
    "position_friction": (15.0, 2, False),
    "dahl_friction": (2.0, 2, False),
    "friction_drift": (15.0, 3, False),
    "friction_change": (4.0, 2, False),
    "covariate_friction": (4.0, 2, False),
    "covariate_offset": (4.0, 2, False),
    "coupled_friction": (3.0, 2, True),
    "armature": (1.0, 2, True),
    "coupled_armature": (4.0, 2, False),
    "spring": (12.0, 2, True),
    "torque_offset": (1.0, 2, True),
    "torque_gain": (4.0, 2, True),
    "torque_crosstalk": (6.0, 3, False),
    "torque_delay": (4.0, 2, False),
    "wrench_gain": (4.0, 2, True),
    "torque_saturation": (4.0, 3, False),
    "ripple": (4.0, 3, False),
    "cable_force": (25.0, 3, False),
    "elasticity": (4.0, 3, False),
    "backlash": (4.0, 3, False),
    "base_tilt": (4.0, 2, True),
    "payload": (4.0, 2, True),
    "encoder_offset": (4.0, 2, True),
    "contact": (60.0, 3, False),
}
REFINED: Mapping[str, tuple[str, ...]] = {
    "nonlinear_viscous_friction": STRAIGHT,
    "stribeck_friction": STRAIGHT,
    "dahl_friction": ("coulomb_friction",),
    "friction_drift": STRAIGHT,
    "friction_change": ("coulomb_friction", "viscous_friction"),
    "covariate_friction": ("coulomb_friction", "viscous_friction"),
    "coupled_friction": STRAIGHT,
    "asymmetric_friction": ("coulomb_friction", "torque_offset"),
    "load_dependent_friction": ("coulomb_friction",),
    "gear_loss": ("coulomb_friction",),
    "position_friction": ("coulomb_friction",),
}


def a_search(effects: Sequence[Effect], mix: Array, torque: Sequence[float]) -> CandidateSearch:
    """On columns of joint 0 that are orthogonal directions times `mix`; noise is of RMS one."""
    data, candidates = planted(effects, on_joint_0(torque), mix)
    plain = data.evidence(candidates, NoiseModel.white(np.ones(2)))
    return CandidateSearch(Judgement(plain, plain, candidates, NO_VETO, anything))


def of(kind: str) -> Effect:
    """With the usual shape."""
    found = catalogue()[kind]
    return found((0,), found.planted(1.0, {})[0])


@pytest.mark.parametrize("kind", list(STATED))
def test_it_is_named_where_it_saves_its_price_and_asked_for_in_its_turn(kind: str) -> None:
    one = of(kind)
    width = len(one.parameters)
    surplus, turn, _ = STATED[kind]
    price = chi2.isf(ALPHA, width) + surplus
    for saved, found in ((price - 0.5, []), (price + 0.5, [0])):
        torque = np.zeros(width)
        torque[0] = np.sqrt(saved / TOTAL)
        assert a_search([one], np.eye(width), torque).run() == found
    search = a_search([one], np.eye(width), np.ones(width))
    turns = [int(tier) for tier in Tier if search._forward([], tier)]
    assert turns == [each for each in (1, 2, 3) if each >= turn]


def test_a_constant_that_noise_bends_a_little_is_no_spring() -> None:
    """Its stiffness would have to save 14 of χ² more than the offset alone."""
    effects = [effect("torque_offset"), effect("spring")]
    mix = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])  # a constant; angle, and the constant
    for saved, found in ((10.0, {0}), (13.0, {0}), (14.5, {1})):
        assert set(a_search(effects, mix, [3.0, np.sqrt(saved / TOTAL)]).run()) == found


def test_noise_is_measured_with_all_usual_effects_in() -> None:
    assert set(STATED) == set(catalogue()), "every kind is stated"
    effects = [of(kind) for kind in STATED]
    candidates = [Candidate(one, (0,), ()) for one in effects]
    kinds = {candidates[i].effect.kind for i in _usual(candidates, [])}
    assert kinds == {kind for kind, (_, _, usual) in STATED.items() if usual}


@pytest.mark.parametrize("kind", list(STATED))
def test_it_waits_for_what_it_refines(kind: str) -> None:
    """Everything exact that is worth its price is there: only what it refines is in its way."""
    others = [name for name, one in catalogue().items() if len(one.parameters) == 1]
    effects = [of(kind), *(of(name) for name in others if name != kind)]
    width = len(effects[0].parameters) + len(effects) - 1
    search = a_search(effects, np.eye(width), np.ones(width))
    schur = search.white.schur([])
    ahead = set(REFINED.get(kind, ()))
    assert search.judge.in_order(schur, [], [0]) == (not ahead)
    for k, one in enumerate(effects[1:], start=1):
        rest = [i for i in range(1, len(effects)) if i != k]
        assert search.judge.in_order(search.white.schur(rest), rest, [0]) == (one.kind not in ahead)


@pytest.mark.parametrize("kind", ["nonlinear_viscous_friction", "coupled_friction", "armature"])
def test_what_stands_for_straight_friction_has_all_of_it_beside_it(kind: str) -> None:
    """Viscous friction is too weak to pass; the square of the speed does not stand for it."""
    shape = {"power": 0.5} if kind == "nonlinear_viscous_friction" else {}
    effects = [*(effect(name) for name in STRAIGHT), effect(kind, **shape)]
    width = 2 + len(effects[2].parameters)
    torque = [0.05, *np.ones(width - 1)]
    found = set(a_search(effects, np.eye(width), torque).run())
    assert found == ({1, 2} if kind == "armature" else {0, 1, 2})


def signals() -> list[Signals]:
    robot = random_robot(4, joints=3, branches=False, prismatic=False)
    return [signals_of(robot, 300)]


@pytest.mark.parametrize(
    ("kind", "name", "value", "steps"),
    [
        ("stribeck_friction", "stribeck_speed", 0.2, [0.07, 0.03, 0.012, 0.004]),
        ("dahl_friction", "distance", 0.1, [0.04, 0.025, 0.015, 8e-3, 3e-3, 1e-3]),
        ("torque_saturation", "level", 10.0, [0.5, 0.2, 0.08, 0.03, 0.01]),
        ("backlash", "gap", 0.01, [1.5e-3, 6e-4, 2e-4, 7e-5]),
        ("nonlinear_viscous_friction", "power", 2.0, None),  # one of few stays open
        ("coupled_friction", "direction", 1.0, None),
    ],
)
def test_shapes_are_refined_as_finely_as_they_are_seen(
    kind: str, name: str, value: float, steps: Sequence[float] | None
) -> None:
    every = shapes_around(effect(kind, **{name: value}), signals())
    found = [each[name] for each in every if {*each} == {name}]  # one at a time
    few = {"power": [0.5, 3.0], "direction": [-1.0]}
    expected = [value + sign * step for step in steps or () for sign in (-1, 1)] or few[name]
    assert found == pytest.approx([value, *expected])


def test_a_bristle_gets_a_damping_and_a_longer_distance_at_once_and_loses_it_again() -> None:
    """Fitted without one, a damped bristle's distance is too short."""
    swinging = signals()
    kind = catalogue()["dahl_friction"]
    every = shapes_around(effect("dahl_friction", distance=0.01), swinging)
    damped = [each for each in every if each.get("damping")]
    assert {round(each["distance"], 6) for each in damped} == {0.01, 0.02, 0.04}
    reversing = np.sqrt(2 * 0.01 * np.sqrt(np.mean(swinging[0].a[:, 0] ** 2)))
    assert max(each["damping"] for each in damped) == pytest.approx(1 / reversing)
    again = shapes_around(kind((0,), {"distance": 0.01, "damping": 3.0}), swinging)
    assert {"distance": 0.01, "damping": 0.0} in again
    assert {"distance": 0.02, "damping": 1.5} in again
    assert all(each["damping"] >= 0.0 for each in again)


def test_ripple_is_refined_by_parts_of_a_cycle_and_a_touch_by_parts_of_its_length() -> None:
    runs = signals()
    travelled = np.ptp(runs[0].q[:, 0])
    _, *others = shapes_around(effect("ripple", periods=30.0), runs)
    cycles = [(each["periods"] - 30.0) * travelled / (2 * np.pi) for each in others]
    assert cycles == pytest.approx(
        [s * c for c in (0.35, 0.15, 0.06, 0.02, 0.006) for s in (-1, 1)]
    )
    _, *others = shapes_around(effect("contact", start=1.0, end=3.0), runs)
    starts = [each["start"] for each in others if each["end"] == 3.0]
    ends = [each["end"] for each in others if each["start"] == 1.0]
    changes = [s * c for c in (0.7, 0.3, 0.12, 0.04) for s in (-1, 1)]
    assert starts == pytest.approx([1.0 + change for change in changes])
    assert ends == pytest.approx([3.0 + change for change in changes])
    assert len(others) == len(starts) + len(ends)


def test_what_is_looked_for() -> None:
    """Or somebody who asks for it by name."""
    robot = random_robot(4, joints=1, branches=False, prismatic=False)
    run = signals_of(robot, 300)

    def drifts(count: int, spec: DiagnosisSpec) -> bool:
        names = [f"run_{k}" for k in range(count)]
        runs = [replace(run, run=RunId(name)) for name in names]
        seen = SeenRuns(robot, runs, [each.load for each in runs], names)
        return any(e.kind == "friction_drift" for e, _ in possible_effects(spec, (), seen, {}))

    every = DiagnosisSpec(exclude=("friction_change",))  # which asks when runs were recorded
    assert not drifts(2, every)
    assert drifts(3, every)
    assert drifts(2, DiagnosisSpec(kinds=("friction_drift",)))
    # A shaft of two joints must not stand still.
    effects = [of("viscous_friction"), effect("coupled_friction", 1, 2, direction=-1.0)]
    assert LeftOut.by(effects).coupled == ((1, 2, -1.0),)
    assert LeftOut.by([of(kind) for kind in STATED if kind != "coupled_friction"]).coupled == ()
    # A touch of a moment is none. A blow of 60 ms is a fault of the record; 200 ms are a touch.
    robot = random_robot(4, joints=3, branches=False, prismatic=False)
    run = signals_of(robot, 800, step=0.01)
    kind = catalogue()["contact"]
    for seconds, count in ((0.06, 0), (0.2, 1)):
        touch = kind((0, 1, 2), {"start": 3.0, "end": 3.0 + seconds})
        residual = touch.torque(run, np.array([30.0, -40.0, 20.0]))
        assert len(kind.tuned(robot, (0, 1, 2), [run], [residual])) == count


@pytest.mark.parametrize(("slowest", "left"), [(0.001, 5), (0.03, 3), (10.0, 0)])
def test_peaks_of_friction_below_the_speeds_that_count_are_not_looked_for(
    slowest: float, left: int
) -> None:
    robot = random_robot(4, joints=1, branches=False, prismatic=False)
    run = signals_of(robot, 300)
    spec = DiagnosisSpec(kinds=("stribeck_friction", "armature"), moving_speed=slowest)
    found = possible_effects(spec, (), SeenRuns(robot, [run], [run.load], ["run"]), {})
    speeds = [e.shape["stribeck_speed"] for e, _ in found if e.kind == "stribeck_friction"]
    assert len(speeds) == left
    assert all(speed >= slowest for speed in speeds)
    assert len(found) == left + 1
