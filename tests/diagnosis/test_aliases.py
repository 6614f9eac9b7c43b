"""Planted candidates that are nearly collinear are aliases, others are not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.aliases import Alias, aliases_of, joint_aliases, other_name
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.armature import Armature
from excite_cli.effects.asymmetric_friction import AsymmetricFriction
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.torque_offset import TorqueOffset
from excite_cli.effects.viscous_friction import ViscousFriction
from tests.diagnosis.explicit_data import FIXED, judge_of, on_joint_0, planted, prepared

SAMPLES = 400
NAMED, NEAR, FAR, ELSEWHERE, WIDE = range(5)
SIZE = 1.0


def case(
    away: float, size: float = SIZE, seed: int = 0
) -> tuple[TrainingData, list[Candidate], Evidence]:
    """Effect NAMED is in the torque; NEAR is it plus `away` of an orthogonal column."""
    rng = np.random.default_rng(seed)
    free, _ = np.linalg.qr(rng.normal(size=(SAMPLES, FIXED + 4)))
    free *= np.sqrt(SAMPLES)
    declared = np.repeat(free[:, None, :FIXED], 2, axis=1)
    truth, other, far = free[:, FIXED], free[:, FIXED + 1], free[:, FIXED + 2]
    tau = rng.normal(size=(SAMPLES, 2))
    tau[:, 0] += size * truth
    near = truth + away * other
    columns: list[tuple[Effect, list[np.ndarray]]] = [
        (CoulombFriction((0,)), [truth]),
        (Armature((0,)), [near]),
        (ViscousFriction((0,)), [far]),
        (CoulombFriction((1,)), [truth]),
        (AsymmetricFriction((0,)), [near, free[:, FIXED + 3]]),
    ]
    candidates = [
        Candidate(e, (e.joints[0],), (np.stack(c, axis=-1)[:, None],)) for e, c in columns
    ]
    runs = (prepared(np.ones((SAMPLES, 2), bool)),)
    data = TrainingData(runs, (0,), (declared,), (tau,))
    return data, candidates, data.evidence(candidates, NoiseModel.white(np.ones(2)))


def anything(rest: Sequence[int], other: int) -> bool:
    return True


def found(away: float, inflation: float = 1.0, seed: int = 0, size: float = SIZE) -> list[Alias]:
    _, candidates, white = case(away, size, seed)
    taken = {candidates[NAMED].place}
    return aliases_of(NAMED, [], taken, candidates, white, inflation, anything)


def test_another_name_of_what_is_there_is_no_alias() -> None:
    """Asymmetric friction is Coulomb friction and an offset: no doubt about either of them."""
    _, candidates, white = case(0.1)
    offset = TorqueOffset((0,)).place
    own = candidates[NAMED].place
    candidates[NEAR] = replace(candidates[NEAR], effect=AsymmetricFriction((0,)))
    for taken, expected in (({own}, [NEAR]), ({own, offset}, [])):
        found = aliases_of(NAMED, [], taken, candidates, white, 1.0, anything)
        assert [alias.candidate for alias in found] == expected
    assert other_name(AsymmetricFriction((0,)), {own, offset}) == (own, offset)
    assert other_name(AsymmetricFriction((1,)), {own, offset}) == ()
    assert other_name(CoulombFriction((0,)), {own, offset}) == ()


def test_a_nearly_collinear_candidate_is_an_alias_and_others_are_not() -> None:
    """E = θ² ‖x‖² (1 − ρ²) = 400 · 0.0099 at an angle of 0.1: KL is 2."""
    aliases = found(0.1)
    assert [alias.candidate for alias in aliases] == [NEAR]
    assert aliases[0].divergence <= 0.5 * SAMPLES * 0.01 * (1.2 * SIZE) ** 2
    # Weak effects and inflated noise have more aliases.
    away = 0.2  # KL is 7.7 for the size of one
    assert found(away) == []
    assert [a.candidate for a in found(away, inflation=8.0)] == [NEAR]
    assert [a.candidate for a in found(away, size=0.35)] == [NEAR]
    # Divergence is that of the two models. Against the brute force: what is left of the fitted
    # signal on the other's column.
    away = 0.05
    _, candidates, white = case(away)
    x, y = (candidates[i].columns[0][:, 0, 0] for i in (NAMED, NEAR))
    theta = white.solve([NAMED])[FIXED]
    signal = theta * x
    left = signal - y * (y @ signal) / (y @ y)
    losses = white.energy([NEAR]) - white.energy([NAMED])
    expected = min(0.5 * left @ left, max(0.5 * losses, 0.0))
    assert found(away)[0].divergence == pytest.approx(expected, rel=1e-6)


def test_places_that_are_taken_or_vetoed_are_left_out() -> None:
    _, candidates, white = case(0.05)
    both = {candidates[NAMED].place, candidates[NEAR].place}
    assert aliases_of(NAMED, [], both, candidates, white, 1.0, anything) == []
    taken = {candidates[NAMED].place}
    vetoed = aliases_of(NAMED, [], taken, candidates, white, 1.0, lambda rest, other: other != NEAR)
    assert vetoed == []
    # More of it in some runs is no other name of it.
    _, candidates, white = case(0.1)
    for kind, expected in ((CoulombFriction, []), (ViscousFriction, [NEAR])):
        pool = list(candidates)
        pool[NEAR] = replace(pool[NEAR], effect=kind((0,), {}, ("a",)))
        taken = {pool[NAMED].place}
        told = aliases_of(NAMED, [], taken, pool, white, 1.0, anything)
        assert [alias.candidate for alias in told] == expected


@pytest.mark.parametrize("away", [0.35, 1.0])
def test_a_candidate_at_an_angle_is_none(away: float) -> None:
    assert found(away) == []


def test_of_several_shapes_at_a_place_the_nearest_is_kept() -> None:
    data, candidates, _ = case(0.05)
    offset = candidates[NAMED].columns[0] * 1.0
    offset[:, 0, 0] += 0.02 * candidates[FAR].columns[0][:, 0, 0]
    nearest = Candidate(Armature((0,), {"another": 1.0}), (0,), (offset,))
    pool = [*candidates, nearest, Candidate(TorqueOffset((1,)), (1,), (offset,))]
    white = data.evidence(pool, NoiseModel.white(np.ones(2)))
    taken = {candidates[NAMED].place}
    aliases = aliases_of(NAMED, [], taken, pool, white, 1.0, anything)
    alone = {
        i: aliases_of(NAMED, [], taken, pool, white, 1.0, lambda rest, other, i=i: other == i)
        for i in (NEAR, 5)
    }
    best = min(alone, key=lambda i: alone[i][0].divergence)
    assert [alias.candidate for alias in aliases] == [best]


SUM = [[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]  # the first effect's column is that of both others


@pytest.mark.parametrize(
    ("mix", "sizes", "chosen", "expected"),
    [
        (SUM, (3.0, 3.0), [0], [((0,), (1, 2))]),
        (SUM, (3.0, 3.0), [1, 2], [((1, 2), (0,))]),
        (SUM, (3.0, 1.0), [1, 2], []),  # of another ratio
        ([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (3.0, 0.0), [0], []),  # one of the pair is enough
        ([[1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]], (3.0, -3.0), [0], []),  # friction would be negative
    ],
)
def test_two_together_may_stand_for_one_and_one_for_two(
    mix: list[list[float]], sizes: Sequence[float], chosen: list[int], expected: list
) -> None:
    effects = [TorqueOffset((0,)), Armature((0,)), ViscousFriction((0,))]
    judge = judge_of(*planted(effects, on_joint_0(sizes), np.array(mix)))
    assert joint_aliases(chosen, judge, chosen) == expected
