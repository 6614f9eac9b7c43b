"""The fit that is told: nothing impossible, errors of inexact columns."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.final_fit import FinalFit, final_fit, friction_lines, signal_to_error
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.identification.least_squares import fit_rows
from tests.diagnosis.explicit_data import FIXED, effect, planted, prepared, traced


def told(given: SearchResult) -> FinalFit:
    return final_fit(given, fit_rows(given.data.rows(given.candidates, given.chosen)))


def test_sizes_are_told_beside_two_standard_deviations() -> None:
    """The second is beyond its noise of 0.05, the third is not."""
    effects = [effect("viscous_friction"), effect("armature"), effect("torque_offset")]
    torque = np.array([[3.0, 0.0], [1.0, 0.0], [0.01, 0.0]])
    data, candidates = planted(effects, torque)
    given = traced(data, candidates, (0, 1, 2))
    found = told(given)
    sizes = signal_to_error(given, found)
    assert {i for i, size in sizes.items() if size > 1.0} == {0, 1}
    assert found.parameters[-3:-1] == pytest.approx([3.0, 1.0], abs=0.1)
    assert found.covariance.shape == (len(found.parameters),) * 2


def test_deviations_hold_what_the_columns_of_an_effect_miss() -> None:
    data, candidates = planted([effect("elasticity")], np.array([[2.0, 0.0]]))
    given = traced(data, candidates, (0,))
    found = told(given)
    missed = candidates[0].effect.model_error(found.parameters[-1:])[0]
    assert missed > 0.1
    exact = replace(given, candidates=(replace(candidates[0], effect=effect("armature")),))
    noise = told(exact).covariance[-1, -1]
    assert found.covariance[-1, -1] == pytest.approx(noise + missed**2)
    # Deviations hold shapes that fit as well. In the second shape columns are twice as large: the
    # size is 3 or 1.5, nobody knows which.
    kind = catalogue()["stribeck_friction"]
    shapes = [kind((0,), {"stribeck_speed": speed}) for speed in (0.1, 0.11)]
    torque = np.array([[3.0, 0.0], [0.0, 0.0]])
    data, candidates = planted(shapes, torque, np.array([[1.0, 2.0], [0.0, 1e-6]]))
    found = told(traced(data, candidates, (0,)))
    assert np.sqrt(found.covariance[-1, -1]) == pytest.approx(1.5 / np.sqrt(2.0), rel=0.05)
    alone = told(traced(data, candidates[:1], (0,)))
    assert np.sqrt(alone.covariance[-1, -1]) < 0.1
    # A shape that physics refuses makes no size uncertain. Of a shaft without dry friction, one
    # direction fits as the other does, but for the sign.
    shaft = catalogue()["coupled_friction"]
    effects: list[Effect] = [shaft((0, 1), {"direction": s}) for s in (1.0, -1.0)]
    mix = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.3]])
    data, candidates = planted(effects, np.array([[2.0, 2.0], [0.0, 0.0]]), mix)
    found = told(traced(data, candidates, (0,), lambda x, chosen, added: 1 not in added))
    both = traced(data, candidates, (0,))
    assert signal_to_error(both, told(both))[0] < 1.0
    assert found.parameters[-2] == pytest.approx(2.0, abs=0.1)
    assert np.sqrt(found.covariance[-2, -2]) < 0.1


def test_a_payload_is_moved_to_a_body_and_all_that_depends_on_it_too() -> None:
    """Its Ixx is negative by the noise; the friction shares a column with it."""
    width = 11
    mix = np.eye(width)
    mix[0, 5] = 1.0
    _, body = catalogue()["payload"].planted(40.0, {"radius": 1.0, "cz": 0.0})
    body[4] = -0.01  # as fitted, with an error of 0.05
    torque = mix @ np.array([2.0, *body])
    data, candidates = planted(
        [effect("viscous_friction"), effect("payload")], np.outer(torque, [1.0, 0.0]), mix
    )
    given = traced(data, candidates, (0, 1))
    fitted = given.judge.plain.solve((0, 1))[-width:]
    found = told(given).parameters[-width:]
    assert fitted[5] < 0.0
    assert candidates[1].effect.possible(found[1:])
    # What the body has gained of the shared column, the friction has lost.
    assert found[0] + found[5] == pytest.approx(fitted[0] + fitted[5], abs=0.05)
    assert found[0] < fitted[0] - 0.01


PARTS, SAMPLES = 2, 200


@dataclass(frozen=True)
class Outcome:
    """What `friction_lines` looks at of a trace."""

    data: TrainingData
    candidates: tuple[Candidate, ...]
    chosen: tuple[int, ...]

    @property
    def effects(self) -> tuple[Effect, ...]:
        return tuple(self.candidates[i].effect for i in self.chosen)


def outcome(effects: Sequence[Effect], seed: int = 0) -> tuple[Outcome, np.ndarray]:
    """And the speeds (PARTS·SAMPLES, 2) behind its columns."""
    speeds = np.random.default_rng(seed).uniform(-2, 2, (PARTS, SAMPLES, 2))

    def column(effect: Effect, v: np.ndarray) -> np.ndarray:
        curve = {
            "viscous_friction": v,
            "coulomb_friction": np.sign(v),
            "nonlinear_viscous_friction": np.sign(v) * np.sqrt(np.abs(v)),
        }
        return curve[effect.kind][:, None, None]

    candidates = tuple(
        Candidate(e, e.joints, tuple(column(e, speeds[p, :, e.joints[0]]) for p in range(PARTS)))
        for e in effects
    )
    zero = np.zeros((SAMPLES, 2))
    runs = tuple(prepared(np.ones((SAMPLES, 2), bool)) for _ in range(PARTS))
    data = TrainingData(
        runs, (0, 1), tuple(np.zeros((SAMPLES, 2, FIXED)) for _ in runs), (zero, zero)
    )
    return Outcome(data, candidates, tuple(range(len(effects)))), speeds.reshape(-1, 2)


ROOT = {"power": 0.5}


def test_the_line_is_the_fit_of_a_line_to_all_friction() -> None:
    effects = [ViscousFriction((0,)), NonlinearViscousFriction((0,), ROOT), CoulombFriction((0,))]
    traced, speeds = outcome(effects)
    v = speeds[:, 0]
    fitted = np.concatenate([np.ones(FIXED), [-0.4, 3.0, -0.5]])  # concave: both are negative
    shown = friction_lines(traced, FIXED + 3) @ fitted  # type: ignore[arg-type]
    friction = -0.4 * v + 3.0 * np.sign(v) * np.sqrt(np.abs(v)) - 0.5 * np.sign(v)
    line = np.linalg.lstsq(np.stack([v, np.sign(v)], axis=1), friction, rcond=None)[0]
    assert shown[FIXED] == pytest.approx(line[0])
    assert shown[FIXED + 2] == pytest.approx(line[1])
    assert line.min() > 0
    assert np.array_equal(shown[: FIXED + 2][[0, 1, 2, 3, 5]], fitted[[0, 1, 2, 3, 5]])


def test_beside_coulomb_friction_alone_its_share_is_added() -> None:
    traced, speeds = outcome([CoulombFriction((1,)), NonlinearViscousFriction((1,), ROOT)])
    v = speeds[:, 1]
    shown = friction_lines(traced, 2) @ np.array([1.0, 2.0])  # type: ignore[arg-type]
    assert shown == pytest.approx([1.0 + 2.0 * np.mean(np.sqrt(np.abs(v))), 2.0])
    # Friction of other joints and curves alone stay as they are.
    effects = [ViscousFriction((0,)), CoulombFriction((0,)), NonlinearViscousFriction((1,), ROOT)]
    traced, _ = outcome(effects)
    assert np.array_equal(friction_lines(traced, FIXED + 3), np.eye(FIXED + 3))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "curved"),
    [
        ("nonlinear_viscous_friction", True),
        ("stribeck_friction", True),
        ("load_dependent_friction", True),
        ("friction_drift", True),
        ("spring", False),
        ("asymmetric_friction", False),  # its levels are what data sheets name
        ("armature", False),
    ],
)
def test_a_line_takes_in_what_curves_beside_it_and_nothing_else(kind: str, curved: bool) -> None:
    traced, speeds = outcome([ViscousFriction((0,)), CoulombFriction((0,))])
    v = speeds[:, 0].reshape(PARTS, SAMPLES)
    other = catalogue()[kind]((0,))
    width = len(other.parameters)
    columns = tuple(np.repeat((3.0 * x + np.sign(x))[:, None, None], width, axis=2) for x in v)
    traced = Outcome(traced.data, (*traced.candidates, Candidate(other, (0,), columns)), (0, 1, 2))
    shown = friction_lines(traced, FIXED + 2 + width)  # type: ignore[arg-type]
    expected = np.eye(FIXED + 2 + width)
    if curved:
        expected[FIXED, FIXED + 2 :], expected[FIXED + 1, FIXED + 2 :] = 3.0, 1.0
    assert shown == pytest.approx(expected, abs=1e-9)
