"""Prices, gains and vetoes against stacked rows, and against closed forms on orthogonal columns."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.schur import Gain
from excite_cli.diagnosis.search import CandidateSearch
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from tests.diagnosis.explicit_data import (
    FIXED,
    FOLDS,
    RULES,
    TOTAL,
    Rows,
    anything,
    autoregression,
    effect,
    judge_of,
    on_joint_0,
    planted,
    random_candidates,
    random_data,
    rows_of,
)


def orthogonal(
    sizes: Mapping[str, float],
    noise: float = 1.0,
    declared: float = 0.0,
    rules: Rules = RULES,
    tests: int = 1,
) -> Judgement:
    """One-column effects of joint 0 by kind and RMS of their torque."""
    effects = [effect(kind) for kind in sizes]
    torque = on_joint_0(list(sizes.values()))
    data, candidates = planted(effects, torque, None, noise, declared)
    return judge_of(data, [replace(c, tests=tests) for c in candidates], rules)


@pytest.fixture(scope="module")
def random_judge() -> tuple[Judgement, Rows, Rows]:
    """On random columns with correlated noise; the rows of both its evidences."""
    data = random_data(21)
    candidates = [replace(c, tests=k + 1) for k, c in enumerate(random_candidates(21))]
    white, plain = autoregression(), NoiseModel.white(np.array([0.9, 2.0]))
    judge = Judgement(
        data.evidence(candidates, white), data.evidence(candidates, plain), candidates,
        Rules(0.05, 0.01, 1.7), anything,
    )  # fmt: skip
    return judge, rows_of(data, candidates, white), rows_of(data, candidates, plain)


@pytest.mark.parametrize("kind", ["viscous_friction", "spring", "contact", "torque_gain"])
@pytest.mark.parametrize(("tests", "inflation", "dof"), [(1, 1.0, 1), (40, 1.0, 2), (7, 2.5, 3)])
def test_the_price_is_what_chance_makes_of_all_tests(
    kind: str, tests: int, inflation: float, dof: int
) -> None:
    """The mean number of tests that χ² without an effect passes is α."""
    one = effect(kind)
    data, [candidate] = planted([one], np.zeros((1, 2)), np.ones((1, len(one.parameters))))
    judge = judge_of(data, [replace(candidate, tests=tests)], Rules(0.03, 0.01, inflation))
    threshold = (judge.price(0, dof) - one.prior_cost) / inflation
    assert tests * chi2.sf(threshold, dof) == pytest.approx(0.03)
    assert judge.price(0, 0) == judge.price(0, 1)


def test_cost_is_residual_energy_and_prices(random_judge: tuple[Judgement, Rows, Rows]) -> None:
    """Whitened; Coulomb friction (4) is cheap beside what refines it (2), dear without."""
    judge, rows, _ = random_judge
    of_all_runs = replace(judge.candidates[4], effect=CoulombFriction((0,)))
    judge = replace(judge, candidates=[*judge.candidates[:4], of_all_runs])
    prices = [1.7 * chi2.isf(0.05 / (k + 1), 1 + (k == 2)) + 4.0 * (k == 2) for k in range(5)]
    for chosen in ([], [0], [2], [3, 1], [4], [4, 2], [0, 1, 2, 3, 4]):
        price = sum(prices[i] for i in chosen)
        if {2, 4} <= set(chosen):
            price += 1.7 * 4.5 - prices[4]
        assert judge.cost(chosen) == pytest.approx(rows.energy(chosen) + price, rel=1e-8)
    # P values are corrected for tests and inflation.
    judge, rows, _ = random_judge
    schur = judge.white.schur([1])
    for i, dof in ((0, 1), (2, 2), (3, 1)):
        lost = rows.energy([1]) - rows.energy([1, i])
        expected = min(1.0, (i + 1) * chi2.sf(lost / 1.7, dof))
        assert judge.p_value(i, schur.gain(i)) == pytest.approx(expected, rel=1e-5)
    assert judge.p_value(3, Gain(30.0, 1, 1.0)) == pytest.approx(4 * chi2.sf(30.0 / 1.7, 1))
    assert judge.p_value(3, Gain(1e-3, 1, 1.0)) == 1.0  # a probability
    assert judge.p_value(3, Gain(0.0, 0, 0.0)) == 1.0
    # Size is the share of the torque of any joint where it is most.
    judge, _, rows = random_judge
    for chosen, added in (([], [0]), ([], [2]), ([1], [3]), ([3], [1, 2])):
        shares = [
            (rows.energy(chosen, [j]) - rows.energy([*chosen, *added], [j]))
            / np.sum(rows.y[rows.joint == j] ** 2)
            for j in (0, 1)
        ]
        assert judge.size(chosen, added, [0, 1]) == pytest.approx(np.sqrt(max(shares)), rel=1e-6)


def test_gains_on_blocks_left_out_are_those_of_explicit_fits() -> None:
    """Side by side on stacked rows, whitened or not, on the joints that are touched."""
    better = []
    for seed in range(3):
        data, candidates = random_data(seed), random_candidates(seed)
        noises = (NoiseModel.white(np.ones(2)), autoregression())
        plain, white = (data.evidence(candidates, noise) for noise in noises)
        judge = Judgement(white, plain, candidates, RULES, anything)
        for chosen, added, joints in (
            ([], [0], [0]),
            ([0], [1], [1]),
            ([1], [2], [0]),
            ([2], [3], [0, 1]),
            ([3], [0, 1], [0, 1]),
        ):
            gains = []
            for noise in noises:
                rows = rows_of(data, candidates, noise)
                before, after = (
                    rows.on_blocks(each)[joints].sum() for each in (chosen, [*chosen, *added])
                )
                gains.append(1 - np.sqrt(after / before))
            assert judge.left_out_gain(chosen, added) == pytest.approx(max(gains), abs=1e-7)
            better.append(gains[0] > gains[1])
    assert any(better)
    assert not all(better)


def test_an_effect_of_some_runs_is_judged_where_it_is_on_blocks_in_turn(
    random_judge: tuple[Judgement, Rows, Rows],
) -> None:
    judge, *both = random_judge
    for chosen in ([], [0]):
        blocks = [
            [rows.on_blocks(each)[0, 2:4].sum() for each in (chosen, [*chosen, 4])] for rows in both
        ]
        expected = max(1 - np.sqrt(after / before) for before, after in blocks)
        assert judge.left_out_gain(chosen, [4]) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(("samples", "brief"), [(6, True), (50, False)])
def test_a_push_that_no_other_block_of_a_second_knows_is_judged_by_what_it_explains(
    samples: int, brief: bool
) -> None:
    data, rng = random_data(5), np.random.default_rng(5)
    columns = [np.zeros((60, 1, 1)) for _ in FOLDS]
    columns[1][8 : 8 + samples] = rng.normal(size=(samples, 1, 1))
    tau = [t + 40.0 * c[:, 0] * [1.0, 0.0] for t, c in zip(data.tau, columns, strict=True)]
    data = replace(data, tau=tuple(tau))
    push = Candidate(CoulombFriction((0,), {}, ("run_1",)), (0,), tuple(columns))
    judge = judge_of(data, [push], allowed=anything)
    rows = rows_of(data, [push], NoiseModel.white(np.ones(2)))
    assert judge.white.is_brief([0]) == brief
    before = rows.on_blocks([])[0, 2:4].sum()
    explained = rows.energy([], [0]) - rows.energy([0], [0])
    after = before - explained if brief else rows.on_blocks([0])[0, 2:4].sum()
    expected = 1 - np.sqrt(after / before)
    assert expected > 0.3
    assert judge.left_out_gain([], [0]) == pytest.approx(expected, rel=1e-3)
    assert judge.verdict([], [0]) is Verdict.ACCEPTED
    assert judge.failing([0]) == []


def test_what_spoils_the_inertias_of_another_joint_is_not_small() -> None:
    """A gain of joint 0 goes into a parameter that both joints have; joint 1 has the error."""
    data, (gain,) = planted([effect("torque_gain", 0)], np.zeros((1, 2)), noise=0.01)
    weak = 0.01  # of what the parameter does on joint 0, so that joint 0 decides its value
    for declared, columns, tau in zip(data.declared, gain.columns, data.tau, strict=True):
        declared[:, 1] *= weak
        columns[:, 0, 0] = 1000.0 * declared[:, 0, 0]
        tau += 1000.0 * declared[:, :, 0] * [1.02, 1.0]
    judge = judge_of(data, [gain])
    assert judge.size([], [0], [0]) < 1e-3
    assert judge.size([], [0], [1]) == pytest.approx(0.02, rel=0.05)
    assert not judge.too_small([], [0])


@pytest.mark.parametrize(
    ("kind", "size", "noise", "declared", "expected"),
    [
        ("viscous_friction", 1.0, 1.0, 1.0, Verdict.ACCEPTED),
        ("viscous_friction", -1.0, 1.0, 1.0, Verdict.IMPLAUSIBLE_SIZE),
        ("torque_offset", -1.0, 1.0, 1.0, Verdict.ACCEPTED),
        # 1 / √(1² + declared²) is 0.1 % of the torque, then 0.25 %.
        ("viscous_friction", 1.0, 0.1, 1000.0, Verdict.TOO_SMALL),
        ("viscous_friction", 1.0, 0.1, 400.0, Verdict.ACCEPTED),
        # 1 − 1 / √(1 + size²) is 0.5 % of the error, then 1.4 %, fitted to half of the data.
        ("viscous_friction", 0.1, 1.0, 1.0, Verdict.NO_GAIN),
        ("viscous_friction", 0.17, 1.0, 1.0, Verdict.ACCEPTED),
    ],
)
def test_verdicts(kind: str, size: float, noise: float, declared: float, expected: str) -> None:
    judge = orthogonal({kind: size}, noise, declared)
    assert judge.verdict([], [0]) == expected


FRICTION = {"viscous_friction": 0.0, "coulomb_friction": 0.0, "load_dependent_friction": 0.0}


def test_first_order_friction_comes_before_what_refines_it() -> None:
    judge = orthogonal({**FRICTION, "viscous_friction": 3.0, "coulomb_friction": 3.0})
    schur = judge.white.schur([])
    assert not judge.in_order(schur, [], [2])  # Coulomb friction is there and not in
    assert judge.in_order(schur, [], [0])
    assert judge.in_order(schur, [], [2, 1])
    assert judge.in_order(judge.white.schur([1]), [1], [2])
    assert not judge.in_order(judge.white.schur([0]), [0], [2])
    for energy, waits in ((0.9, False), (1.6, True)):  # of its price
        worth = np.sqrt(energy * chi2.isf(0.01 / 20, 1) / TOTAL)
        weak = orthogonal({**FRICTION, "coulomb_friction": worth}, tests=20)
        assert weak.in_order(weak.white.schur([]), [], [2]) != waits
    impossible = orthogonal({**FRICTION, "coulomb_friction": -3.0})
    assert impossible.in_order(impossible.white.schur([]), [], [2])
    # Parents are those of the same joint.
    effects = [
        effect("coulomb_friction", 1),
        effect("viscous_friction", 1),
        effect("asymmetric_friction", 1),
        effect("coulomb_friction", 0),
        effect("torque_offset", 1),
        effect("nonlinear_viscous_friction", 0, power=2.0),
        effect("coupled_friction", 0, 1),
        effect("armature", 1),
    ]
    width = sum(len(each.parameters) for each in effects)
    judge = judge_of(*planted(effects, np.zeros((width, 2))))
    found = [set(parents) for parents in judge.parents]
    assert found == [set(), set(), {0, 4}, set(), set(), {3}, {3, 1, 0}, set()]
    every = list(range(8))
    assert judge.without(0, every) == [1, 3, 4, 5, 7]
    assert judge.without(3, every) == [0, 1, 2, 4, 7]
    assert judge.without(2, every) == [0, 1, 3, 4, 5, 6, 7]


@pytest.mark.parametrize(("power", "bound"), [(0.5, True), (2.0, False)])
def test_root_friction_binds_both_straight_terms(power: float, bound: bool) -> None:
    effects = [
        effect("viscous_friction"),
        effect("coulomb_friction"),
        effect("nonlinear_viscous_friction", power=power),
        effect("spring"),
    ]
    torque = on_joint_0([-1.0, 0.01, 1.0, 1.0, 0.0])
    judge = judge_of(*planted(effects, torque))
    every = [0, 1, 2, 3]
    assert [judge.bound(i, every) for i in every] == [bound, bound, False, False]
    assert not judge.bound(0, [0, 1, 3])
    # Bound ones stay whatever they are; other parents unless they cannot be.
    assert (0 in judge.failing(every)) != bound
    assert 1 not in judge.failing(every)
    assert 0 in judge.failing([0, 1, 3])
    assert 1 in judge.failing([0, 1, 3])


@pytest.mark.parametrize(
    ("size", "noise", "declared", "tests", "inflation", "fails"),
    [
        (0.2, 1.0, 1.0, 1, 1.0, False),  # χ² = 0.2² · 200
        (0.2, 1.0, 1.0, 10, 1.0, True),
        (0.2, 1.0, 1.0, 1, 2.0, True),
        (-1.0, 1.0, 1.0, 1, 1.0, True),
        (0.6, 5.0, 1.0, 1, 1.0, True),  # gains 0.7 %
        (1.0, 0.1, 1000.0, 1, 1.0, True),  # 0.1 % of the torque
        (1.0, 0.1, 400.0, 1, 1.0, False),
    ],
)
def test_members_that_do_not_hold(
    size: float, noise: float, declared: float, tests: int, inflation: float, fails: bool
) -> None:
    sizes = {"viscous_friction": size, "armature": 2.0}
    judge = orthogonal(sizes, noise, declared, Rules(0.01, 0.01, inflation), tests)
    assert (0 in judge.failing([0, 1])) == fails


def test_members_that_share_nearly_all_they_have_hold_if_they_are_significant() -> None:
    """Friction terms at an angle of 0.01: each alone nearly says what the other does."""
    mix = np.array([[1.0, 1.0], [0.0, 0.01]])
    effects = [effect("viscous_friction"), effect("coulomb_friction")]
    torque = on_joint_0([200.0, 1.0])  # 100 of each
    judge = judge_of(*planted(effects, torque, mix))
    assert judge.plain.solve([0, 1])[FIXED:] == pytest.approx([100.0, 100.0], rel=1e-4)
    assert 0 not in judge.failing([0, 1])
    assert 1 not in judge.failing([0, 1])


WEIGHT = 1000.0


def weighed(gain: float, std: float, on: Sequence[Effect]) -> Judgement:
    """Torques too large by `gain`; the weight that joint 0 carries is known with `std`, if any.

    Effects have the columns of that weight: each explains all of it, beside free inertias.
    """
    data, _ = planted([effect("torque_gain")], np.zeros((1, 2)))
    for declared, tau in zip(data.declared, data.tau, strict=True):
        declared[:, 1, 0] = 0.0
        tau[:, 1] *= 3.0  # the noise, beside which an effect of both rows looks smaller
        tau += (1.0 + gain) * WEIGHT * declared[:, :, 0]
    columns = tuple(WEIGHT * declared[:, :, :1] for declared in data.declared)
    candidates = [Candidate(one, one.joints, tuple(c[:, list(one.joints)] for c in columns))
                  for one in on]  # fmt: skip
    known = np.array([[1.0, 0.0, 0.0, 0.0, WEIGHT]]) / std if std else np.zeros((0, FIXED + 1))
    return judge_of(replace(data, prior=known.T @ known, weighed=known.T @ known), candidates)


@pytest.mark.parametrize(
    ("gain", "std", "expected"),
    [
        (0.04, 5.0, Verdict.ACCEPTED),
        (-0.04, 5.0, Verdict.ACCEPTED),
        (0.7, 50.0, Verdict.IMPLAUSIBLE_SIZE),
        (0.0015, 0.5, Verdict.TOO_SMALL),  # of 0.2 % that a name needs
    ],
)
def test_a_gain_that_takes_a_weight_to_be_told_need_not_lower_the_error(
    gain: float, std: float, expected: Verdict
) -> None:
    judge = weighed(gain, std, [effect("torque_gain")])
    assert judge.identified_by_prior_only(0, [])
    assert judge.left_out_gain([], [0]) < 0.01
    assert judge.verdict([], [0]) == expected
    assert (0 in judge.failing([0])) == (expected is not Verdict.ACCEPTED)


@pytest.mark.parametrize("std", [0.0, 30.0])
def test_without_a_weight_or_one_that_is_hardly_known_a_gain_has_no_name(std: float) -> None:
    """40 of a gain beside 30 of the scales; or inertias take it up."""
    judge = weighed(0.04, std, [effect("torque_gain")])
    assert judge.identified_by_prior_only(0, []) == (std > 0.0)
    assert 0 in judge.failing([0])
    assert CandidateSearch(judge).run() == []


def test_of_what_a_weight_tells_as_well_the_gain_of_all_rows_is_named() -> None:
    """An offset of the weight's row would do, and so would a gain of that row alone."""
    effects = [effect("torque_offset", 0), effect("torque_gain", 0), effect("wrench_gain", 0, 1)]
    for std in (5.0, 0.3):  # by 0.3, inertias are bent so that the error shows it as well
        judge = weighed(0.04, std, effects)
        assert CandidateSearch(judge).run() == [2]
        assert CandidateSearch(judge).run([0]) == [2]
    assert judge.left_out_gain([], [0]) > judge.left_out_gain([], [2]) + 0.2
    for i, alone in enumerate(effects[:2]):
        extra = judge.price(i, 1) - weighed(0.04, 0.3, [alone]).price(0, 1)
        assert extra > 20.0  # as much as none of the three could save by chance
    assert not judge.identified_by_prior_only(0, [])  # an offset alone is judged by the error
    assert not judge.identified_by_prior_only(1, [2])  # what is named already is not told again
