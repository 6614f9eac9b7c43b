"""The friction and rotors that stay beside what was found, and those that surely do not matter."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis import final_fit as final_fit_
from excite_cli.diagnosis import sufficient as sufficient_
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.sufficient import those_that_matter, with_everyday
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.judgement import Seen
from excite_cli.robot.model import Array
from tests.diagnosis.test_extrapolation import FAST, ROBOT, SLOW, TORQUE, crept, kind, made, usual

WITHOUT_INERTIAS: Any = SimpleNamespace(base=SimpleNamespace(selection=[]), declared=())


def found_with(seen: Signals, effects: Sequence[Effect], tau: Array, level: float) -> SearchResult:
    """The first of these was found, beside noise of this level [N·m]."""
    data, candidates = made(seen, effects, tau)
    noise = NoiseModel.white(np.full(ROBOT.n, level))
    evidence = data.evidence(candidates, noise)
    seen_sizes = Seen(np.full(ROBOT.n, 9.0), np.ones(ROBOT.n), 1.0)
    sizes = PossibleSizes(candidates, evidence.covariance, seen_sizes)
    judge = Judgement(evidence, evidence, candidates, Rules(0.01, 0.01), sizes)
    return SearchResult(
        data, tuple(candidates), noise, judge, (0,), np.zeros(0), (), np.full(ROBOT.n, level),
        1.0, sizes, WITHOUT_INERTIAS, usual(seen),
    )  # fmt: skip


def noisy(seen: Signals, inertia: float, level: float) -> Array:
    noise = level * np.random.default_rng(0).normal(size=seen.v.shape)
    return np.asarray(TORQUE * np.sign(seen.v) + inertia * seen.a + noise)


@pytest.mark.parametrize(
    ("fastest", "inertia", "level", "stays"),
    [
        (SLOW, 1.0, 0.1, True),  # much, along another motion
        (SLOW, 0.1, 0.1, True),  # perhaps: what may be there is next to nothing in these data
        (FAST, 0.0, 0.1, False),  # it is known to be next to nothing
        (FAST, 0.003, 0.1, False),  # little, of the torque and of what is left
        (FAST, 0.003, 1e-3, True),  # little, and much of what is left
        (FAST, 0.0, 1e-3, False),
    ],
)
def test_a_rotor_stays_unless_it_surely_does_not_matter(
    fastest: float, inertia: float, level: float, stays: bool
) -> None:
    seen = crept(fastest)
    given = found_with(
        seen,
        [kind("coulomb_friction"), kind("armature")],
        noisy(seen, inertia, level),
        level,
    )
    assert with_everyday(given, [0]) == ([0, 1] if stays else [0])
    assert those_that_matter(given, [0, 1]) == ([0, 1] if stays else [0])


@pytest.mark.parametrize(
    ("missed", "brief", "answer"),
    [(True, False, [2, 1]), (False, True, [2, 1]), (False, False, [2])],
)
def test_what_single_runs_carry_stays_beside_the_textbook_if_its_own_seconds_miss_it(
    monkeypatch: pytest.MonkeyPatch, missed: bool, brief: bool, answer: list[int]
) -> None:
    """Whatever new recordings say, which are predicted best by the textbook's model."""
    monkeypatch.setattr(sufficient_, "with_everyday", lambda traced, some: list(some))
    monkeypatch.setattr(sufficient_, "those_that_matter", lambda traced, some: list(some))
    effects = [kind("spring"), replace(kind("coulomb_friction"), runs=("b",)), kind("armature")]
    judge: Any = SimpleNamespace(
        white=SimpleNamespace(is_brief=lambda some: brief),
        without=lambda i, some: [k for k in some if k != i],
    )
    traced: Any = SimpleNamespace(
        plain=(2,),
        chosen=(0, 1),
        parts_of=lambda i: [],
        judge=judge,
        candidates=[SimpleNamespace(effect=each, rows=(0,), width=1) for each in effects],
    )
    no_better = SimpleNamespace(better=False)
    models: Any = SimpleNamespace(
        difference=lambda one, other: no_better, missed=lambda chosen, rest, rows: missed
    )
    assert sufficient_.sufficient(traced, models) == answer


@pytest.mark.parametrize(("plain_is_larger", "answer"), [(True, [0, 1]), (False, [0])])
def test_of_models_that_differ_by_less_than_two_per_cent(
    monkeypatch: pytest.MonkeyPatch, plain_is_larger: bool, answer: list[int]
) -> None:
    """The textbook's claims nothing: it stays where it is surely better. Names must be worth it."""
    monkeypatch.setattr(sufficient_, "with_everyday", lambda traced, some: list(some))
    monkeypatch.setattr(sufficient_, "those_that_matter", lambda traced, some: list(some))
    effects = [kind("coulomb_friction"), kind("torque_offset")]
    one, both = (0,), (0, 1)
    traced: Any = SimpleNamespace(
        plain=both if plain_is_larger else one,
        chosen=one if plain_is_larger else both,
        parts_of=lambda i: [],
        judge=None,
        candidates=[SimpleNamespace(effect=each, rows=(0,), width=1) for each in effects],
    )

    def difference(one: list[int], other: list[int]) -> SimpleNamespace:
        return SimpleNamespace(better=len(other) > len(one), of_error=0.01)

    models: Any = SimpleNamespace(difference=difference, missed=None)
    assert sufficient_.sufficient(traced, models) == answer


@pytest.mark.parametrize(
    ("gained", "possible", "answer"),
    [(0.001, True, [2, 1]), (0.05, True, [0, 1]), (0.001, False, [0, 1])],
)
def test_a_part_of_an_effect_takes_its_place_where_it_predicts_as_well(
    gained: float, possible: bool, answer: list[int]
) -> None:
    """Losses of a gear that are the same both ways are friction by load, if that can be so."""
    judge: Any = SimpleNamespace(
        plain=SimpleNamespace(solve=lambda some: np.zeros(0)),
        allowed=lambda parameters, some, added: possible,
    )
    names = ("gear_loss", "coulomb_friction", "load_dependent_friction")
    effects = [kind(name) for name in names]
    traced: Any = SimpleNamespace(
        plain=(1,),
        chosen=(0, 1),
        judge=judge,
        candidates=[
            SimpleNamespace(effect=each, rows=(0,), width=len(each.parameters), place=each.place)
            for each in effects
        ],
    )
    traced.parts_of = lambda i: SearchResult.parts_of(traced, i)
    assert traced.parts_of(0) == [2]
    assert traced.parts_of(1) == []

    def difference(one: list[int], other: list[int]) -> SimpleNamespace:
        return SimpleNamespace(better=len(other) > len(one), of_error=gained)

    models: Any = SimpleNamespace(difference=difference, missed=None)
    found = sufficient_._by_parts(traced, models)
    assert found == answer


def test_an_offset_may_have_any_size() -> None:
    """11 kN·m of it made up for a spring that nobody named: without, all of the mean was left."""
    seen = crept(FAST)
    both = [kind("coulomb_friction"), kind("torque_offset")]
    given = found_with(seen, both, noisy(seen, 0.0, 0.1) + 100.0, 0.1)
    assert those_that_matter(given, [0, 1]) == [0, 1]
    other = found_with(
        seen, [*both, kind("viscous_friction")], given.data.tau[0] - 50 * seen.v, 1.0
    )
    assert 2 not in those_that_matter(other, [0, 1, 2])  # friction may not


@pytest.mark.parametrize(
    ("kinds", "offset", "viscous", "level", "joins"),
    [
        (("asymmetric_friction", "coulomb_friction"), 0.0, 0.0, 1.0, False),  # it has its columns
        (("coulomb_friction", "torque_offset"), 1.0, 0.0, 1.0, False),
        (("coulomb_friction", "viscous_friction"), 0.0, 20.0, 1e-3, True),
        (("coulomb_friction", "viscous_friction"), 0.0, -20.0, 1e-3, False),  # it is impossible
    ],
)
def test_whether_another_joins_what_was_found(
    kinds: tuple[str, ...], offset: float, viscous: float, level: float, joins: bool
) -> None:
    seen = crept(SLOW)
    tau = TORQUE * np.sign(seen.v) + offset + viscous * seen.v
    given = found_with(seen, [kind(each) for each in kinds], tau, level)
    assert with_everyday(given, [0]) == ([0, 1] if joins else [0])


def test_what_the_data_do_not_tell_from_what_was_found_is_shared_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a joint that never turned round friction and offset are one number, as in a textbook.

    Either may be all of it, whatever is imagined beside the data.
    """
    monkeypatch.setattr(final_fit_, "usual_sizes", lambda robot, base, effects: np.full(2, 10.0))
    nothing: Any = SimpleNamespace(
        robot=None, base=None, declared=(), known=np.zeros((0, 1)), prior=None, vague=True
    )
    seen = crept(SLOW)
    seen = replace(seen, v=np.abs(seen.v) + SLOW)
    for names in (("coulomb_friction", "torque_offset"), ("torque_offset", "coulomb_friction")):
        given = found_with(seen, [kind(each) for each in names], noisy(seen, 0.0, 0.1), 0.1)
        assert with_everyday(given, [0]) == [0]  # the textbook's model does without
        given = replace(given, plain=(0, 1))
        assert with_everyday(given, [0]) == [0, 1]
        assert given.fitted([0, 1]) == pytest.approx(np.full(2, TORQUE / 2), rel=0.02)
        linear = final_fit_.regression(replace(given, chosen=(0, 1)), nothing)
        assert np.sqrt(np.diag(linear.shown)) == pytest.approx(np.abs(linear.x), rel=0.01)
        assert linear.shown.sum() < 1e-3  # the sum is known
        assert not linear.seen.any()


def test_what_is_not_of_every_robot_is_left_alone_and_one_of_two_alike_leaves() -> None:
    seen = crept(FAST)
    spring = [kind("coulomb_friction"), kind("spring")]
    given = found_with(seen, spring, noisy(seen, 0.0, 0.1), 0.1)
    assert with_everyday(given, [0]) == [0]
    assert those_that_matter(replace(given, chosen=(0, 1)), [0, 1]) == [0, 1]
    rotors = [kind("coulomb_friction"), kind("armature"), kind("armature")]
    twice = found_with(seen, rotors, noisy(seen, 1.0, 0.1), 0.1)
    assert len(those_that_matter(replace(twice, chosen=(0, 1, 2)), (0, 1, 2))) == 2


def test_what_tests_promise_too_much_makes_sizes_less_sure() -> None:
    """A rotor that surely is next to nothing perhaps is not where errors are that much larger."""
    seen = crept(FAST)
    both = [kind("coulomb_friction"), kind("armature")]
    given = found_with(seen, both, noisy(seen, 0.003, 0.1), 0.1)
    assert with_everyday(given, [0]) == [0]
    assert with_everyday(replace(given, inflation=1e3), [0]) == [0, 1]
