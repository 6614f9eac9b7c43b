"""Whether a model predicts data left out better: the textbook's sets and the sufficient one."""

from collections.abc import Sequence

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.comparison import as_new, difference, left_out
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.sufficient import sufficient
from excite_cli.diagnosis.textbook import everyday, textbook
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from tests.diagnosis.explicit_data import FOLDS, anything, prepared

SAMPLES = 400
FIXED = 3


def judge_of(sizes: Sequence[tuple[Effect, float]], seed: int = 0) -> Judgement:
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
    runs = tuple(prepared(np.ones((SAMPLES, 1), bool)) for _ in FOLDS)
    data = TrainingData(runs, FOLDS, tuple(declared), tuple(tau))
    candidates = [
        Candidate(effect, (0,), tuple(own)) for (effect, _), own in zip(sizes, columns, strict=True)
    ]
    evidence = data.evidence(candidates, NoiseModel.white(np.ones(1)))
    return Judgement(evidence, evidence, candidates, Rules(0.01, 0.01), anything)


def effect(kind: str, runs: tuple[str, ...] = ()) -> Effect:
    return catalogue()[kind]((0,), {}, runs)


def everyday_judge(offset: float, armature: float, spring: float = 0.0) -> Judgement:
    kinds = {
        "viscous_friction": 1.0,
        "coulomb_friction": 1.0,
        "torque_offset": offset,
        "armature": armature,
        "spring": spring,
    }
    return judge_of([(effect(kind), size) for kind, size in kinds.items()])


def test_by_how_much_a_model_is_better_and_how_surely() -> None:
    """The energy of an effect of RMS one half beside unit noise, in units of a block's noise."""
    judge = judge_of([(effect("viscous_friction"), 0.5), (effect("armature"), 0.0)])
    found = difference(judge, [], [0])
    assert found.size == pytest.approx(0.25 * 2 * (max(FOLDS) + 1), rel=0.3)
    assert found.better
    assert difference(judge, [0], []).size < 0.0
    assert not difference(judge, [0], [0, 1]).better


def test_what_one_run_shows_is_judged_on_its_other_blocks_and_is_not_in_a_new_recording() -> None:
    judge = judge_of([(effect("payload", ("b",)), 0.5), (effect("armature"), 0.2)])
    assert difference(judge, [], [0]).better
    assert as_new(judge, [], [0]).size < 1.0
    assert left_out(judge.plain, []) == pytest.approx(
        0.5 * np.log(judge.plain.as_new([]).sum()), rel=1e-12
    )


@pytest.mark.parametrize(
    ("offset", "armature", "expected"),
    [(0.0, 0.0, {0, 1}), (0.5, 0.0, {0, 1, 2}), (0.0, 0.5, {0, 1, 3}), (0.5, 0.5, {0, 1, 2, 3})],
)
def test_offset_and_armature_are_in_the_textbook_where_data_ask(
    offset: float, armature: float, expected: set[int]
) -> None:
    judge = everyday_judge(offset, armature)
    assert set(textbook(judge)) == expected
    assert everyday(judge.candidates) == [0, 1, 2, 3]


def test_the_sufficient_model_lacks_what_data_left_out_do_not_miss() -> None:
    judge = everyday_judge(0.0, 0.5, 0.5)
    assert set(sufficient(judge, [0, 1, 2, 3, 4])) == {0, 1, 3, 4}


def test_the_textbook_is_the_answer_where_nothing_beats_it() -> None:
    judge = everyday_judge(0.5, 0.5)
    assert set(sufficient(judge, [0, 4])) == {0, 1, 2, 3}
    assert set(sufficient(everyday_judge(0.0, 0.0), [0, 1])) == {0, 1}  # it is that
