"""Runs that are worse from one on are seen, by their order alone; chance is not."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.records import EffectRecord
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.scoring.records import RunExplanation, Score, ScoredRun
from excite_cli.scoring.score import shift_of, with_shift
from excite_cli.summary.score import in_words

NAMES = ("a", "b", "c", "d", "e", "f")
NOTHING = Errors(0.1, 0.1, {}, {}, {}, {}, (0.0, 0.0), {}, {})


def run(k: int, ratios: np.ndarray, alarm: bool = False) -> ScoredRun:
    ratio = dict(zip(NAMES, map(float, ratios), strict=True))
    return ScoredRun(f"run {k}", f"{k}.h5", 10.0, NOTHING, ratio=ratio, left=("a",) * alarm)


def runs(worse: float, since: int, seed: int = 0, count: int = 20) -> list[ScoredRun]:
    ratios = np.random.default_rng(seed).normal(1.0, 0.03, (count, 6))
    ratios[since:, 2] *= worse
    return [run(k, row) for k, row in enumerate(ratios)]


def reason(joint: str) -> RunExplanation:
    return RunExplanation(EffectRecord("encoder_offset", (joint,), {}, (0.01,)), {}, 0.6)


def test_the_joint_and_the_run_are_seen() -> None:
    found = shift_of(runs(1.5, 16), NAMES)
    assert found is not None
    assert (found.first, found.joints, found.runs) == (16, ("c",), (16, 17, 18, 19))
    assert found.times == pytest.approx(1.5, rel=0.1)
    assert found.usual["c"] == pytest.approx(1.0, abs=0.05)
    # Alarms before do not count and alarms after do.
    given = runs(1.6, 16)
    given[3] = run(3, np.full(6, 9.0), alarm=True)
    given[18:] = [replace(each, left=("c",)) for each in given[18:]]
    found = shift_of(given, NAMES)
    assert found is not None
    assert (found.first, found.runs) == (16, (16, 17, 18, 19))
    assert (
        shift_of([*given[:16], *(replace(each, left=("c",)) for each in given[16:])], NAMES) is None
    )
    # The time of recording is the order.
    given = runs(1.5, 16)
    stamped = [replace(each, epoch=float(k)) for k, each in enumerate(given)]
    mixed = [stamped[k] for k in np.random.default_rng(3).permutation(20)]
    found = shift_of(mixed, NAMES)
    assert found is not None
    assert mixed[found.first].name == "run 16"
    assert shift_of([replace(each, epoch=None) for each in mixed], NAMES) is None


@pytest.mark.parametrize(("worse", "since"), [(1.1, 16), (1.5, 18), (1.0, 10), (0.6, 10)])
def test_what_is_small_short_or_better_is_none(worse: float, since: int) -> None:
    assert shift_of(runs(worse, since), NAMES) is None


def test_chance_seldom_looks_like_one() -> None:
    rng = np.random.default_rng(11)
    spread = [rng.lognormal(0.0, 0.3, (12, 6)) for _ in range(400)]
    found = [shift_of([run(k, row) for k, row in enumerate(rows)], NAMES) for rows in spread]
    assert sum(each is not None for each in found) <= 20


def test_a_common_reason_makes_alarms_and_none_makes_a_question() -> None:
    given = runs(1.5, 16)
    shift = shift_of(given, NAMES)
    assert shift is not None
    again = [replace(each, left=("c",), reasons=(reason("c"),)) for each in given[16:]]
    again[1] = replace(again[1], reasons=(reason("a"),))
    found, findings = with_shift(given, shift, again)
    assert [each.alarm for each in found] == [False] * 16 + [True, False, True, True]
    assert findings[0].text.startswith("since run 16 the error of c is 1.5 times that of the runs")
    loud = [*given[:18], *(replace(each, left=("c",)) for each in given[18:])]
    assert with_shift(loud, shift, again)[0][18:] == loud[18:]
    lost, _ = with_shift(given, shift, [again[0], *again[2:]])  # a file that is gone by now
    assert [each.alarm for each in lost[15:]] == [False, True, False, True, True]
    other = [replace(each, reasons=(reason("abcd"[k]),)) for k, each in enumerate(again)]
    found, findings = with_shift(given, shift, other)
    assert found == given
    assert "Did the motion change?" in findings[0].text


def test_data_that_nothing_explains_are_said_to_be_of_another_robot() -> None:
    one = replace(run(0, np.full(6, 9.0), alarm=True), peak=dict.fromkeys(NAMES, 9.0))
    score = Score("model.h5", "fit", NAMES, ("N·m",) * 6, (one,), NOTHING, NOTHING)
    assert "nothing that changes" in in_words(one, score)
    wrong = replace(one, error=replace(NOTHING, mean_relative_moving=1.15))
    assert in_words(wrong, score).endswith("these data seem to be of another robot")
