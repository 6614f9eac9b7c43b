"""Whether a model predicts data left out better: the textbook's sets and the sufficient one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.comparison import Comparison
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.sufficient import sufficient
from excite_cli.diagnosis.textbook import everyday, textbook
from excite_cli.diagnosis.tracing import Traced
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.seen import Seen
from excite_cli.measurement.run_identity import RunId
from tests.diagnosis.explicit_data import FOLDS, prepared
from tests.diagnosis.test_doubt import planted, traced

SAMPLES = 400
SIZES = lambda _, sums: sums.T @ sums, Seen(np.full(2, 9.0), np.ones(2), 1.0)
FIXED = 3


def traced_of(sizes: Sequence[tuple[Effect, float]], seed: int = 0) -> Traced:
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
        replace(prepared(np.ones((SAMPLES, 1), bool)), run=RunId(str(fold))) for fold in FOLDS
    )
    data = TrainingData(runs, FOLDS, tuple(declared), tuple(tau))
    candidates = [
        Candidate(effect, (0,), tuple(own)) for (effect, _), own in zip(sizes, columns, strict=True)
    ]
    return traced(data, candidates, range(len(sizes)))


def models_of(given: Traced) -> Comparison:
    every = range(len(given.candidates))
    return Comparison(given.data, given.candidates, every, given.levels, given.noise)


def effect(kind: str, runs: tuple[str, ...] = ()) -> Effect:
    return catalogue()[kind]((0,), {}, runs)


def everyday_traced(offset: float, armature: float, spring: float = 0.0) -> Traced:
    kinds = {
        "viscous_friction": 1.0,
        "coulomb_friction": 1.0,
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
    needed = models.needed([0, 1])
    assert needed[1].size == pytest.approx(models.difference([0], [0, 1]).size, rel=1e-6)
    assert needed[0].size == pytest.approx(models.difference([1], [0, 1]).size, rel=1e-6)


def test_what_one_run_shows_is_judged_on_its_other_blocks_and_is_not_in_a_new_recording() -> None:
    given = traced_of([(effect("payload", ("b",)), 0.5), (effect("armature"), 0.2)])
    models = models_of(given)
    assert models.difference([], [0]).better
    assert models.as_new([], [0]).size < 1.0
    assert models.as_new([], [1]).of_error > 0.0


def test_parts_of_one_recording_are_no_new_recordings() -> None:
    """Each is a stretch of the same motion, and may be the only one in which something shows."""
    given = traced_of([(effect("payload", ("b",)), 0.5), (effect("armature"), 0.2)])
    one = tuple(replace(run, run=RunId("log")) for run in given.data.runs)
    models = models_of(replace(given, data=replace(given.data, runs=one)))
    assert models.as_new([], [0]).better


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


def chosen(given: Traced, found: Sequence[int]) -> set[int]:
    return set(sufficient(replace(given, chosen=tuple(found)), models_of(given)))


def test_the_sufficient_model_lacks_what_data_left_out_do_not_miss() -> None:
    assert chosen(everyday_traced(0.0, 0.5, 0.5), [0, 1, 2, 3, 4]) == {0, 1, 3, 4}


def test_what_cannot_be_leaves() -> None:
    """A spring that pushes away, however well it predicts."""
    given = traced_of([(effect("spring"), -2.0), (effect("armature"), 1.0)])
    judge = replace(given.judge, allowed=PossibleSizes(given.candidates, *SIZES))
    assert chosen(replace(given, judge=judge), [0, 1]) == {1}


def test_the_textbook_is_the_answer_where_nothing_beats_it() -> None:
    given = everyday_traced(0.5, 0.5)
    assert chosen(given, [0, 4]) == {0, 1, 2, 3}
    assert chosen(everyday_traced(0.0, 0.0), [0, 1]) == {0, 1}  # it is that


@pytest.mark.parametrize(("second", "better"), [(0.0, False), (1.0, True)])
def test_what_acts_on_two_joints_must_predict_both_better(second: float, better: bool) -> None:
    """Of one of them alone half of it predicts both together better, and it is another effect."""
    data, candidates = planted([catalogue()["viscous_friction"]((0, 1))], np.array([[1.0, second]]))
    given = traced(data, candidates, [0])
    assert models_of(given).difference([], [0]).better
    assert models_of(given).needed([0])[0].better is better


def test_one_recording_asks_for_more() -> None:
    """What is left out of it is a part of the same motion."""
    given = traced_of([(effect("viscous_friction"), 1.0)])
    run = RunId("only")
    alone = replace(given.data, runs=tuple(replace(r, run=run) for r in given.data.runs))
    several = models_of(given).difference([], [0]).confidence
    assert models_of(replace(given, data=alone)).difference([], [0]).confidence > several
