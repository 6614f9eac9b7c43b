"""Whether a model predicts data left out better: the textbook's sets and the sufficient one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.comparison import ModelComparison
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.sufficient import sufficient
from excite_cli.diagnosis.textbook import everyday, textbook
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import (
    FOLDS,
    effect,
    planted,
    prepared,
    traced,
    usual_of_unit_columns,
)

SAMPLES = 400
FIXED = 3


def traced_of(sizes: Sequence[tuple[Effect, float]], seed: int = 0) -> SearchResult:
    """A joint's torque of random columns of these effects times their sizes, and unit noise."""
    rng = np.random.default_rng(seed)
    declared = [rng.normal(size=(SAMPLES, 1, FIXED)) for _ in FOLDS]
    columns = [
        [
            rng.normal(size=(SAMPLES, 1, len(effect.parameters)))
            * (not effect.runs or fold == FOLDS[-1])
            for fold in FOLDS
        ]
        for effect, _ in sizes
    ]
    tau = [
        rng.normal(size=(SAMPLES, 1))
        + sum(size * own[part].sum(axis=2) for (_, size), own in zip(sizes, columns, strict=True))
        for part in range(len(FOLDS))
    ]
    runs = tuple(
        replace(prepared(np.ones((SAMPLES, 1), bool), tau=own), run=RunId(str(fold)))
        for fold, own in zip(FOLDS, tau, strict=True)
    )
    data = TrainingData(runs, FOLDS, tuple(declared), tuple(tau))
    candidates = [
        Candidate(effect, (0,), tuple(own)) for (effect, _), own in zip(sizes, columns, strict=True)
    ]
    found = traced(data, candidates, range(len(sizes)))
    return replace(found, usual=usual_of_unit_columns(1, FIXED))


def models_of(given: SearchResult) -> ModelComparison:
    every = range(len(given.candidates))
    return ModelComparison(given.data, given.candidates, every, given.levels)


def everyday_traced(
    offset: float, armature: float, spring: float = 0.0, friction: float = 1.0
) -> SearchResult:
    kinds = {
        "viscous_friction": friction,
        "coulomb_friction": friction,
        "torque_offset": offset,
        "armature": armature,
        "spring": spring,
    }
    return traced_of([(effect(kind), size) for kind, size in kinds.items()])


def test_by_how_much_a_model_is_better_and_how_surely() -> None:
    """Of every block the logarithm of 1.25, an effect of RMS one half beside unit noise."""
    given = traced_of([(effect("viscous_friction"), 0.5), (effect("armature"), 0.0)])
    models = models_of(given)
    found = models.difference([], [0])
    assert found.blocks == len(FOLDS) * SAMPLES * 0.02
    assert found.size / found.blocks == pytest.approx(np.log(1.25), rel=0.2)
    assert found.better
    assert models.difference([0], []).size < 0.0
    assert not models.difference([0], [0, 1]).better
    # A name is missed more surely than a model is better.
    assert models.missed([0, 1], [1], (0,))
    assert not models.missed([0, 1], [0], (0,))


def test_what_one_run_shows_is_not_in_a_new_recording() -> None:
    given = traced_of([(replace(effect("payload"), runs=("b",)), 0.5), (effect("armature"), 0.2)])
    models = models_of(given)
    assert models.difference([], [0]).size < 1.0
    assert models.difference([], [1]).size > 0.0
    # Of few recordings too. Every block takes the joint through all of its travel: the others know
    # what is in it.
    q = np.tile(np.linspace(0.0, 1.0, 50), len(FOLDS) * SAMPLES // 50)
    q += np.random.default_rng(0).normal(size=len(q))
    assert models_of(alone(given, q)).difference([], [0]).better


def alone(given: SearchResult, q: Array) -> SearchResult:
    """The same samples, as parts of one recording in which the joint is at q (M,)."""
    at = np.split(q[:, None], len(FOLDS))
    runs = (replace(r, run=RunId("log"), q=own) for r, own in zip(given.data.runs, at, strict=True))
    return replace(given, data=replace(given.data, runs=tuple(runs)))


@pytest.mark.parametrize("everywhere", [True, False])
def test_of_one_recording_a_quarter_of_the_travel_is_predicted_by_the_rest(
    everywhere: bool,
) -> None:
    """What shows in one part of it only is not known to be there elsewhere."""
    given = traced_of([(replace(effect("payload"), runs=() if everywhere else ("b",)), 0.5)])
    q = np.linspace(0.0, 1.0, len(FOLDS) * SAMPLES)
    found = models_of(alone(given, q)).difference([], [0])
    assert found.better if everywhere else found.size < 1.0


@pytest.mark.parametrize(
    ("offset", "armature", "expected"),
    [(0.0, 0.0, {0, 1}), (0.5, 0.0, {0, 1, 2}), (0.0, 0.5, {0, 1, 3}), (0.5, 0.5, {0, 1, 2, 3})],
)
def test_offset_and_armature_are_in_the_textbook_where_data_ask(
    offset: float, armature: float, expected: set[int]
) -> None:
    given = everyday_traced(offset, armature)
    assert set(textbook(given.candidates, models_of(given))) == expected
    assert everyday(given.candidates) == [0, 1, 2, 3]


def chosen(given: SearchResult, found: Sequence[int]) -> set[int]:
    models = models_of(given)
    plain = textbook(given.candidates, models)
    return set(sufficient(replace(given, chosen=tuple(found), plain=tuple(plain)), models))


def test_what_was_found_is_the_answer_with_what_every_robot_has() -> None:
    """Not with an armature that is surely next to nothing."""
    assert chosen(everyday_traced(0.0, 0.5, 0.5), [4]) == {0, 1, 3, 4}
    assert chosen(everyday_traced(0.0, 0.0, 0.5, friction=10.0), [4]) == {0, 1, 4}
    # The textbook is the answer where nothing beats it.
    given = everyday_traced(0.5, 0.5)
    assert chosen(given, [0, 4]) == {0, 1, 2, 3}
    assert chosen(everyday_traced(0.0, 0.0), [0, 1]) == {0, 1}  # it is that


@pytest.mark.parametrize(("second", "missed"), [(0.0, False), (1.0, True)])
def test_what_acts_on_two_joints_must_be_missed_on_both(second: float, missed: bool) -> None:
    """Of one of them alone half of it predicts both together better, and it is another effect."""
    data, candidates = planted([effect("viscous_friction", 0, 1)], np.array([[1.0, second]]))
    given = replace(traced(data, candidates, [0]), usual=usual_of_unit_columns(2, 0))
    models = models_of(given)
    assert models.difference([], [0]).better
    assert models.missed([0], [], (0, 1)) is missed


def test_a_quarter_of_the_travel_is_left_out_whenever_the_joint_is_there() -> None:
    """Not a quarter of the time: the seconds in the last quarter are all over the recording."""
    given = traced_of([(effect("payload"), 0.5)])
    place = 7 * np.arange(32) % 32  # of every second
    there = np.split(np.repeat(place >= 24, 50)[:, None, None], len(FOLDS))
    (candidate,) = given.candidates
    columns = tuple(c * here for c, here in zip(candidate.columns, there, strict=True))
    tau = tuple(
        t - 0.5 * (c - own).sum(axis=2)
        for t, c, own in zip(given.data.tau, candidate.columns, columns, strict=True)
    )
    given = replace(
        given,
        data=replace(given.data, tau=tau),
        candidates=(replace(candidate, columns=columns),),
    )
    found = models_of(alone(given, np.repeat(place / 32, 50))).difference([], [0])
    assert found.size < 1.0
