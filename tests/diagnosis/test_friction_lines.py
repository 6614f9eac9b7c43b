"""Viscous and Coulomb friction beside a curve are told as the straight line through all of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.final_fit import friction_lines
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from tests.diagnosis.explicit_data import FIXED, prepared

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


def test_friction_of_other_joints_and_curves_alone_stay_as_they_are() -> None:
    effects = [ViscousFriction((0,)), CoulombFriction((0,)), NonlinearViscousFriction((1,), ROOT)]
    traced, _ = outcome(effects)
    assert np.array_equal(friction_lines(traced, FIXED + 3), np.eye(FIXED + 3))  # type: ignore[arg-type]
