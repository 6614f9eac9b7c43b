"""The search against all subsets of a few candidates, and what it must never choose."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, combinations

import numpy as np
import pytest
from scipy.stats import chi2

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.search import CandidateSearch
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import (
    FIXED,
    FOLDS,
    LARGE,
    ONE,
    Rows,
    anything,
    effect,
    prepared,
    rows_of,
)

SAMPLES = 40
# Of joint 0.
VISCOUS, COULOMB = effect("viscous_friction"), effect("coulomb_friction")
OFFSET, ARMATURE = effect("torque_offset"), effect("armature")
NO_VETO = Rules(0.01, -1.0)


def planted(
    effects: Sequence[Effect],
    values: Array | Sequence[float],
    mix: Array | None = None,
    seed: int = 0,
) -> tuple[TrainingData, list[Candidate]]:
    """Random columns of RMS near one, times `mix`, in the torque with these values, and noise.

    `mix` (columns, columns) makes columns of effects from independent ones; noise is of RMS one.
    """
    rng = np.random.default_rng(seed)
    count = len(values)
    mix = np.eye(count) if mix is None else mix
    declared = tuple(rng.normal(size=(SAMPLES, 2, FIXED)) for _ in FOLDS)
    every = [rng.normal(size=(SAMPLES, 2, count)) @ mix for _ in FOLDS]
    base = rng.normal(size=FIXED)
    tau = [d @ base + rng.normal(size=(SAMPLES, 2)) for d in declared]
    candidates, at = [], 0
    for one in effects:
        width, joints = len(one.parameters), list(one.joints)
        blocks = tuple(x[:, joints, at : at + width] for x in every)
        for torque, block in zip(tau, blocks, strict=True):
            torque[:, joints] += block @ np.asarray(values[at : at + width])
        candidates.append(Candidate(one, one.joints, blocks, tests=len(effects)))
        at += width
    assert at == count
    runs = tuple(prepared(np.ones((SAMPLES, 2), bool)) for _ in FOLDS)
    return TrainingData(runs, FOLDS, declared, tuple(tau)), candidates


def search(
    data: TrainingData,
    candidates: Sequence[Candidate],
    rules: Rules = NO_VETO,
    signs: bool = False,
    most: int = 80,
) -> set[int]:
    evidence = data.evidence(candidates, ONE)
    sizes = PossibleSizes(candidates, evidence.covariance, LARGE)
    allowed = sizes if signs else anything
    found = CandidateSearch(Judgement(evidence, evidence, candidates, rules, allowed), most).run()
    assert len(found) == len(set(found))
    return set(found)


def judged(data: TrainingData, candidates: Sequence[Candidate]) -> Judgement:
    """Whatever is lost on runs left out, and of any size."""
    evidence = data.evidence(candidates, ONE)
    return Judgement(evidence, evidence, candidates, NO_VETO, anything)


def cost(rows: Rows, candidates: Sequence[Candidate], chosen: Sequence[int]) -> float:
    """J: residual energy on stacked rows, and prices; a parent beside a child costs 4.5."""
    price = 0.0
    for i in chosen:
        own = candidates[i].effect
        children = [candidates[k].effect for k in chosen if k != i]
        if any(own.kind in child.refines for child in children):
            price += 4.5
        else:
            family = chi2.isf(0.01 / candidates[i].tests, candidates[i].width)
            price += family + own.prior_cost
    return rows.energy(chosen) + price


def cheapest(data: TrainingData, candidates: Sequence[Candidate]) -> set[int]:
    """The set of least J of all sets in which no place is taken twice."""
    rows, count = rows_of(data, candidates, ONE), len(candidates)
    sets = chain.from_iterable(combinations(range(count), k) for k in range(count + 1))
    valid = [s for s in sets if len({candidates[i].place for i in s}) == len(s)]
    assert len(valid) > 2 ** (count - 1)
    return set(min(valid, key=lambda s: cost(rows, candidates, list(s))))


# No one refines another; two shapes of the last kind share a place.
LOCAL_AND_COHERENT = [
    VISCOUS,
    COULOMB,
    OFFSET,
    effect("armature", 1),
    effect("spring", 1),
    effect("viscous_friction", 0, 1),
    effect("ripple", 0, periods=1.0),
    effect("ripple", 0, periods=2.0),
]
FRICTION = [
    VISCOUS,
    COULOMB,
    OFFSET,
    effect("load_dependent_friction"),
    effect("asymmetric_friction"),
    effect("nonlinear_viscous_friction", power=2.0),
]


def random_case(
    effects: Sequence[Effect], seed: int, weakest: float
) -> tuple[TrainingData, list[Candidate]]:
    """Columns that are nearly orthogonal; about half of the effects are there."""
    rng = np.random.default_rng([seed, 1])
    widths = [len(each.parameters) for each in effects]
    there = rng.random(len(effects)) < 0.5
    count = sum(widths)
    sizes = rng.uniform(weakest, 1.0, count) * rng.choice([-1.0, 1.0], count)
    mix = np.eye(count) + 0.15 * rng.normal(size=(count, count))
    return planted(effects, np.repeat(there, widths) * sizes, mix, seed)


@pytest.mark.parametrize("seed", range(10))
def test_the_set_of_least_cost_is_found(seed: int) -> None:
    data, candidates = random_case(LOCAL_AND_COHERENT, seed, 0.1)
    assert search(data, candidates) == cheapest(data, candidates)


@pytest.mark.parametrize("seed", range(10))
def test_nearly_the_least_cost_is_found_among_friction_and_what_refines_it(seed: int) -> None:
    """J may fall a little by a useless child that makes its parent cheap: that is not followed."""
    data, candidates = random_case(FRICTION, seed, 0.5)
    rows = rows_of(data, candidates, ONE)
    found, best = (sorted(s) for s in (search(data, candidates), cheapest(data, candidates)))
    assert cost(rows, candidates, found) < cost(rows, candidates, best) + 2.0
    assert set(found) <= set(best)


def test_weak_first_order_friction_is_cheap_beside_what_refines_it() -> None:
    """No step that adds a parent of a chosen effect and passes may be left undone."""
    assert search(*random_case(FRICTION, 28, 0.1)) == {0, 1, 4}


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4), (4, 3, 2, 1, 0), (2, 0, 4, 1, 3)])
def test_the_order_of_candidates_does_not_matter(order: tuple[int, ...]) -> None:
    data, candidates = random_case(LOCAL_AND_COHERENT[:5], 3, 0.1)
    expected = search(data, candidates)
    found = search(data, [candidates[i] for i in order])
    assert {order[i] for i in found} == expected != set()


def test_noise_has_no_names() -> None:
    """Forty free looks at every seed; alarms in a share α of all seeds, at most 5 of 100."""
    effects = [effect("viscous_friction", joint) for joint in (0, 1) for _ in range(20)]
    alarms = 0
    for seed in range(100):
        data, candidates = planted(effects, np.zeros(40), seed=seed)
        alarms += bool(search(data, candidates))
    assert alarms <= 5


def opposed(seed: int = 0) -> tuple[TrainingData, list[Candidate]]:
    """Two columns at an angle of 0.2, one in the torque and the other taken off it; and a third."""
    effects = [VISCOUS, ARMATURE, OFFSET]
    data, candidates = planted(effects, [0.0, 0.0, 0.0], seed=seed)
    nearly = []
    for k, tau in enumerate(data.tau):
        one, other = (c.columns[k][:, 0, 0] for c in candidates[:2])
        across = other - one * (one @ other) / (one @ one)
        nearly.append((np.cos(0.2) * one + np.sin(0.2) * across)[:, None, None])
        tau[:, 0] += 3.5 * (one - nearly[k][:, 0, 0])
    return data, [candidates[0], replace(candidates[1], columns=tuple(nearly)), candidates[2]]


@pytest.mark.parametrize("seed", range(4))
def test_two_effects_that_hide_each_other_are_found_together(seed: int) -> None:
    """χ² of each alone is N a² (1 − ρ)², less than noise, of both 2 N a² (1 − ρ), about 80."""
    data, candidates = opposed(seed)
    alone = data.evidence(candidates, ONE).schur([])
    assert max(alone.singles[0].chi2, alone.singles[1].chi2) < 8.0
    if seed == 0:
        assert search(data, candidates, signs=True) == set(), "no armature is negative"
    assert search(data, candidates, Rules(0.01, 0.01)) == {0, 1}


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_impossible_sign_is_never_chosen(sign: float) -> None:
    """Friction that drives is explained by what comes near it and may have any sign."""
    effects = [VISCOUS, effect("ripple", periods=1.0), COULOMB]
    mix = np.eye(4)
    mix[0, 1] = 1.0  # the ripple has the same, and a part of its own
    data, candidates = planted(effects, [sign, 0.0, 0.0, 0.0], mix)
    assert search(data, candidates, signs=True) == ({0} if sign > 0 else {1})
    assert search(data, candidates, signs=False) == {0}
    assert search(data, candidates[::2], signs=True) == ({0} if sign > 0 else set())


@pytest.mark.parametrize("seed", range(8))
def test_all_that_is_chosen_has_a_possible_sign_beside_all_others(seed: int) -> None:
    data, candidates = random_case(LOCAL_AND_COHERENT, seed, 0.1)
    found = sorted(search(data, candidates, signs=True))
    evidence = data.evidence(candidates, ONE)
    sizes = PossibleSizes(candidates, evidence.covariance, LARGE)
    assert sizes(evidence.solve(found), found, found)


@pytest.mark.parametrize("most", [0, 1, 2, 3])
def test_no_more_effects_are_added_than_allowed(most: int) -> None:
    """Weak friction of a joint makes room for a strong spring."""
    effects = [VISCOUS, effect("spring", 1), effect("coulomb_friction", 1)]
    data, candidates = planted(effects, [1.0, 2.0, 2.0, 0.5])
    assert search(data, candidates, most=most) == set(range(most))
    # One effect of a pair stands for both until the other replaces it by two.
    pair = planted([effect("armature", 1), effect("coulomb_friction", 1)], [2.0, 1.0])
    assert len(search(*pair, most=most)) == min(most, 2)


def test_gains_on_runs_left_out_are_demanded() -> None:
    data, candidates = planted([VISCOUS, ARMATURE], [0.5, 2.0])
    gain = 1.0 - 1.0 / np.sqrt(1.0 + 0.5**2)  # of the weaker one, once the other is in
    assert search(data, candidates, Rules(0.01, 0.5 * gain)) == {0, 1}
    assert search(data, candidates, Rules(0.01, 2.0 * gain)) == {1}


def test_one_coherent_effect_wins_over_many_local_ones() -> None:
    """Of joint 0 alone a local one explains the same: two parameters for one."""
    data, [both] = planted([effect("torque_delay", 0, 1)], [0.6])
    local = []
    for joint in (0, 1):
        own = tuple(columns[:, [joint]] for columns in both.columns)
        local.append(Candidate(effect("torque_delay", joint), (joint,), own))
    assert search(data, [*local, both]) == {2}
    assert search(data, local) == {0, 1}


@pytest.mark.parametrize(("offset", "found"), [(0.0, {0}), (0.2, {0}), (1.0, {1})])
def test_friction_that_differs_by_direction_must_be_worth_it_beside_dry_friction(
    offset: float, found: set[int]
) -> None:
    """It holds the column of dry friction: in its place it would cost next to nothing more."""
    effects = [COULOMB, effect("asymmetric_friction")]
    mix = np.array([[1.0, 0.5, 0.5], [0.0, 0.5, -0.5], [0.0, 0.0, 0.0]])
    data, candidates = planted(effects, [2.0, offset, -offset], mix, seed=3)
    schur = data.evidence(candidates, ONE).schur([0])
    assert schur.singles[1].dof == 1
    if offset == 0.2:
        assert 7.0 < schur.singles[1].chi2 < 11.5  # it is there, and is no more than chance
    assert search(data, candidates) == found


def test_one_that_stands_for_two_is_replaced_by_both() -> None:
    """Neither is worth its price beside it, nor are both: only their exchange lowers J."""
    effects = [ARMATURE, OFFSET, effect("torque_gain")]
    half, part = np.sqrt(0.5 * 0.9), np.sqrt(0.1)
    mix = np.array([[1.0, 0.0, half], [0.0, 1.0, half], [0.0, 0.0, part]])
    data, candidates = planted(effects, [0.65, 0.65, 0.0], mix, seed=7)
    beside = data.evidence(candidates, ONE).schur([2])
    assert max(beside.singles[0].chi2, beside.singles[1].chi2) < 8.0
    assert beside.gain(0, 1).chi2 < 18.0
    assert search(data, candidates) == cheapest(data, candidates) == {0, 1}


def test_what_is_closed_is_not_put_in_to_complete_either() -> None:
    """√|v| friction brings Coulomb friction of its joint with it, however small, if it may."""
    effects = [VISCOUS, COULOMB, effect("nonlinear_viscous_friction", power=0.5)]
    data, candidates = planted(effects, [2.0, 0.0, 2.0], np.eye(3))
    judge = judged(data, candidates)
    assert set(CandidateSearch(judge).run()) == {0, 1, 2}
    assert set(CandidateSearch(judge, closed={candidates[1].place}).run((2, 0))) == {0, 2}


def test_what_does_not_hold_in_the_end_leaves_its_place_to_another() -> None:
    """The second explains most of what the first does; the first is dropped when all is chosen."""

    class Dropping(CandidateSearch):
        def pruned(self, chosen: list[int]) -> list[int]:
            return [i for i in chosen if i != 0]

    mix = np.array([[1.0, 0.9], [0.0, 0.3]])
    data, candidates = planted([VISCOUS, ARMATURE], [3.0, 0.0], mix)
    assert search(data, candidates) == {0}
    judge = judged(data, candidates)
    assert set(Dropping(judge).run()) == {1}
    assert set(CandidateSearch(judge).run()) == {0}


@pytest.mark.parametrize(("sizes", "left"), [((2.0, 0.5), [0]), ((0.5, 2.0), [1])])
def test_what_makes_the_size_of_another_impossible_leaves_if_it_is_the_weaker(
    sizes: tuple[float, float], left: list[int]
) -> None:
    data, candidates = planted([OFFSET, ARMATURE], sizes)

    def allowed(parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """The first has no possible size beside the second."""
        return not (0 in added and 1 in chosen)

    evidence = data.evidence(candidates, ONE)
    judge = Judgement(evidence, evidence, candidates, NO_VETO, allowed)
    assert CandidateSearch(judge).pruned([0, 1]) == left


def judge_of_three() -> Judgement:
    effects = [VISCOUS, ARMATURE, OFFSET]
    return judged(*planted(effects, [5.0, 3.0, 2.0]))


def test_steps_that_go_round_end_with_the_cheapest(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is added is dropped again, and passes again: once round is enough."""
    judge = judge_of_three()
    turns = {(): [2], (2,): [0], (0,): [1], (1,): [0]}  # 2, then 0 and 1 in turn
    asked: list[tuple[int, ...]] = []

    def polish(_: CandidateSearch, chosen: list[int]) -> list[int]:
        asked.append(tuple(chosen))
        return turns[tuple(chosen)]

    monkeypatch.setattr(CandidateSearch, "_forward", lambda _, chosen, latest: chosen)
    monkeypatch.setattr(CandidateSearch, "_polish", polish)
    assert judge.cost([0]) < judge.cost([1]) < judge.cost([2])
    assert CandidateSearch(judge)._settled([]) == [0]
    assert asked == [(), (2,), (0,), (1,)]


@pytest.mark.parametrize(("second", "expected"), [([1, 2], [1]), ([1, 2, 0], [0])])
def test_more_names_in_place_of_those_that_do_not_hold_are_no_answer(
    monkeypatch: pytest.MonkeyPatch, second: list[int], expected: list[int]
) -> None:
    """Of [0, 1] only 0 holds; as many names may be tried in its place, but no more."""
    judge = judge_of_three()
    sets = iter([[0, 1], second])
    holds = iter([[0], [1]])
    monkeypatch.setattr(CandidateSearch, "_settled", lambda *_: next(sets, [1]))
    monkeypatch.setattr(CandidateSearch, "pruned", lambda *_: next(holds, [1]))
    monkeypatch.setattr(judge, "cost", lambda chosen: -float(len(chosen)))
    monkeypatch.setattr("excite_cli.diagnosis.search._GROWN", 1.0)
    assert CandidateSearch(judge).run() == expected


@pytest.mark.parametrize(("power", "beside", "replacing"), [(0.5, {0, 1, 2}, {0}), (2.0, {2}, {1})])
def test_root_friction_replaces_no_straight_friction_and_keeps_both_terms(
    power: float, beside: set[int], replacing: set[int]
) -> None:
    """It comes near Coulomb friction, which another refinement may replace."""
    root = effect("nonlinear_viscous_friction", power=power)
    mix = np.eye(3)
    mix[1, 2] = 1.0
    assert search(*planted([VISCOUS, COULOMB, root], [0.0, 0.0, 1.0], mix)) == beside
    # Beside Coulomb friction it is not worth its price; alone it lowers J a little.
    near = np.array([[1.0, 1.0], [0.0, 0.2]])
    data, candidates = planted([COULOMB, root], [0.0, 1.0], near, seed=1)
    assert 3.0 < data.evidence(candidates, ONE).schur([0]).singles[1].chi2 < 9.0
    assert search(data, candidates) == replacing


@pytest.mark.parametrize(
    ("values", "found"), [((2.0, 1.0, 1.5), {0, 2}), ((1.0, 2.0, 1.5), {1, 2})]
)
def test_play_and_elasticity_are_never_both_named_for_a_joint(
    values: tuple[float, ...], found: set[int]
) -> None:
    """Both are in the torque of joint 0, one each in those of the others."""
    effects = [effect("backlash", 0), effect("elasticity", 0), effect("backlash", 1)]
    assert search(*planted(effects, values)) == found
