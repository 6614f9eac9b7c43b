"""Time stamps: what is spoiled here on purpose is mended there, and said."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.missing_values import rows_of
from excite_cli.measurement.stamps import equidistant
from tests.measurement.recordings import motion, only, recorded

RUN = recorded()
JITTERED = RUN.t + np.random.default_rng(1).uniform(-0.2, 0.2, len(RUN.t)) / 200


def follows_the_motion(run: Run, within: float = 1e-5) -> None:
    """Positions are those of the motion at the stamps, which are equidistant."""
    assert np.ptp(np.diff(run.t)) < 1e-9
    np.testing.assert_allclose(run.q, motion(run.t)[0], atol=within)


def test_even_stamps_stay_untouched() -> None:
    (back,), findings = equidistant(RUN)
    assert back is RUN
    assert findings == []


def test_jitter_is_resampled_and_masks_survive_it() -> None:
    valid = np.ones(RUN.q.shape, bool)
    valid[400:420, 1] = False
    (back,), findings = equidistant(replace(RUN, t=JITTERED, q=motion(JITTERED)[0], valid=valid))
    assert "200" in only(findings, "jitter").text
    assert len(back.t) == len(RUN.t)
    follows_the_motion(back)
    assert not back.usable()[400:420, 1].any()
    assert back.usable()[:, [0, 2]].all()
    assert np.count_nonzero(~back.usable()) <= 22


def test_a_gap_splits_the_run() -> None:
    keep = (RUN.t < 3.0) | (RUN.t >= 3.3)
    parts, findings = equidistant(rows_of(RUN, keep))
    found = only(findings, "gap")
    assert "1 gap in time, the longest of 0.305 s at 2.995 s" in found.text
    assert [part.label for part in parts] == ["run/1", "run/2"]
    assert parts[1].t[0] == pytest.approx(3.3)
    for part in parts:
        follows_the_motion(part)
        assert part.valid is None
    assert sum(len(part.t) for part in parts) == np.count_nonzero(keep)


def test_a_short_gap_is_bridged_and_masked() -> None:
    keep = np.ones(len(RUN.t), bool)
    keep[[500, 501, 900]] = False
    (back,), findings = equidistant(rows_of(RUN, keep))
    assert "2 short gaps of up to 0.015 s" in only(findings, "bridged").text
    assert len(back.t) == len(RUN.t)
    follows_the_motion(back)
    assert np.flatnonzero(~back.usable().any(axis=1)).tolist() == [500, 501, 900]


def test_short_parts_are_left_out_and_said() -> None:
    keep = (RUN.t < 3.0) | (RUN.t >= 3.2) & (RUN.t < 3.4) | (RUN.t > 3.8)
    parts, findings = equidistant(rows_of(RUN, keep))
    assert [found.kind for found in findings] == ["gap", "short_part"]
    assert "1 parts shorter than 0.5 s" in findings[1].text
    assert [part.label for part in parts] == ["run/1", "run/2"]


def test_samples_in_another_order_or_twice() -> None:
    order = np.arange(len(RUN.t))
    order[[300, 301, 302, 303]] = [303, 300, 301, 302]
    order[[700, 701]] = [701, 700]
    twice = np.sort(np.r_[0:1600, 10, 20, 30])
    for rows, kind, words in (
        (order, "reordered", "goes back 2 times"),
        (twice, "duplicate_stamps", "3 samples carry the same stamp"),
    ):
        (back,), findings = equidistant(rows_of(RUN, rows))
        assert words in only(findings, kind).text
        np.testing.assert_array_equal(back.q, RUN.q)
        np.testing.assert_array_equal(back.tau, RUN.tau)


def test_a_stray_stamp() -> None:
    t = RUN.t.copy()
    t[640] = 0.0
    (back,), findings = equidistant(replace(RUN, t=t))
    assert [found.kind for found in findings] == ["stamps", "bridged"]
    follows_the_motion(back)
    assert not back.usable()[640].any()


def test_time_that_starts_anew() -> None:
    first, second = RUN, recorded(4.0)
    t = np.concatenate([first.t, second.t])
    both = Run("run", t, motion(t)[0], np.vstack([first.tau, second.tau]))
    parts, findings = equidistant(both)
    only(findings, "restart")
    assert [len(part.t) for part in parts] == [1600, 800]
    np.testing.assert_array_equal(parts[1].tau, second.tau)


@pytest.mark.parametrize("clock", [0.02, 0.01])
def test_a_coarse_clock_is_spread(clock: float) -> None:
    coarse = np.floor(RUN.t / clock + 1e-9) * clock
    (back,), findings = equidistant(replace(RUN, t=coarse))
    assert "coarse clock" in only(findings, "bursts").text
    assert len(back.t) == len(RUN.t)
    np.testing.assert_allclose(back.t, RUN.t, atol=clock)


def test_time_that_cannot_be_used() -> None:
    with pytest.raises(FileError, match="time stands still at 3"):
        equidistant(replace(RUN, t=np.full(len(RUN.t), 3.0)))
    with pytest.raises(FileError, match="has 5 samples; at least 10"):
        equidistant(RUN.cut(0, 5))
    scattered = rows_of(RUN, np.arange(len(RUN.t)) % 40 < 10)
    with pytest.raises(FileError, match=r"falls into 40 pieces.*too irregular"):
        equidistant(scattered)


@pytest.mark.parametrize("t", [np.where(np.arange(120) < 119, 5e-324, 0.0),
                               np.arange(120.0, 0.0, -1.0) * 1e-310])  # fmt: skip
def test_time_that_goes_back_by_less_than_any_clock_counts(t: np.ndarray) -> None:
    q = np.sin(np.arange(120.0))[:, None]
    with pytest.raises(FileError, match="no clock gives such time stamps"):
        equidistant(Run("r", t, q, q))
