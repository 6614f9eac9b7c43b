"""Time stamps: what is spoiled here on purpose is mended there, and said."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.missing_values import rows_of
from excite_cli.measurement.stamps import equidistant
from tests.measurement.recordings import motion, only, recorded

STEP = 1 / 200


def follows_the_motion(run: Run, within: float = 1e-5) -> None:
    """Positions are those of the motion at the stamps, which are equidistant."""
    steps = np.diff(run.t)
    assert np.ptp(steps) < 1e-9
    np.testing.assert_allclose(run.q, motion(run.t)[0], atol=within)


def test_even_stamps_stay_untouched() -> None:
    run = recorded()
    (back,), findings = equidistant(run)
    assert back is run
    assert findings == []


def test_jitter_is_resampled() -> None:
    run = recorded()
    t = run.t + np.random.default_rng(1).uniform(-0.2, 0.2, len(run.t)) * STEP
    (back,), findings = equidistant(replace(run, t=t, q=motion(t)[0]))
    found = only(findings, "jitter")
    assert "200" in found.text
    assert len(back.t) == len(run.t)
    follows_the_motion(back)


def test_a_gap_splits_the_run() -> None:
    run = recorded()
    keep = (run.t < 3.0) | (run.t >= 3.3)
    parts, findings = equidistant(rows_of(run, keep))
    found = only(findings, "gap")
    assert "1 gap in time, the longest of 0.305 s at 2.995 s" in found.text
    assert [part.label for part in parts] == ["run/1", "run/2"]
    assert parts[1].t[0] == pytest.approx(3.3)
    for part in parts:
        follows_the_motion(part)
        assert part.valid is None
    assert sum(len(part.t) for part in parts) == np.count_nonzero(keep)


def test_a_short_gap_is_bridged_and_masked() -> None:
    run = recorded()
    keep = np.ones(len(run.t), bool)
    keep[[500, 501, 900]] = False
    (back,), findings = equidistant(rows_of(run, keep))
    assert "2 short gaps of up to 0.015 s" in only(findings, "bridged").text
    assert len(back.t) == len(run.t)
    follows_the_motion(back)
    assert np.flatnonzero(~back.usable().any(axis=1)).tolist() == [500, 501, 900]


def test_short_parts_are_left_out_and_said() -> None:
    run = recorded()
    keep = (run.t < 3.0) | (run.t >= 3.2) & (run.t < 3.4) | (run.t > 3.8)
    parts, findings = equidistant(rows_of(run, keep))
    assert [found.kind for found in findings] == ["gap", "short_part"]
    assert "1 parts shorter than 0.5 s" in findings[1].text
    assert [part.label for part in parts] == ["run/1", "run/2"]


def test_samples_in_another_order() -> None:
    run = recorded()
    order = np.arange(len(run.t))
    order[[300, 301, 302, 303]] = [303, 300, 301, 302]
    order[[700, 701]] = [701, 700]
    (back,), findings = equidistant(rows_of(run, order))
    assert "goes back 2 times" in only(findings, "reordered").text
    np.testing.assert_array_equal(back.tau, run.tau)


def test_duplicates() -> None:
    run = recorded()
    (back,), findings = equidistant(rows_of(run, np.sort(np.r_[0:1600, 10, 20, 30])))
    assert "3 samples carry the same stamp" in only(findings, "duplicate_stamps").text
    np.testing.assert_array_equal(back.q, run.q)


def test_a_stray_stamp() -> None:
    run = recorded()
    t = run.t.copy()
    t[640] = 0.0
    (back,), findings = equidistant(replace(run, t=t))
    assert [found.kind for found in findings] == ["stamps", "bridged"]
    follows_the_motion(back)
    assert not back.usable()[640].any()


def test_time_that_starts_anew() -> None:
    first, second = recorded(), recorded(4.0)
    t = np.concatenate([first.t, second.t])
    both = Run("run", t, motion(t)[0], np.vstack([first.tau, second.tau]))
    parts, findings = equidistant(both)
    only(findings, "restart")
    assert [len(part.t) for part in parts] == [1600, 800]
    np.testing.assert_array_equal(parts[1].tau, second.tau)


@pytest.mark.parametrize("clock", [0.02, 0.01])
def test_a_coarse_clock_is_spread(clock: float) -> None:
    run = recorded()
    coarse = np.floor(run.t / clock + 1e-9) * clock
    (back,), findings = equidistant(replace(run, t=coarse))
    assert "coarse clock" in only(findings, "bursts").text
    assert len(back.t) == len(run.t)
    np.testing.assert_allclose(back.t, run.t, atol=clock)


def test_masks_survive_resampling() -> None:
    run = recorded()
    valid = np.ones(run.q.shape, bool)
    valid[400:420, 1] = False
    t = run.t + np.random.default_rng(1).uniform(-0.2, 0.2, len(run.t)) * STEP
    (back,), _ = equidistant(replace(run, t=t, valid=valid))
    assert not back.usable()[400:420, 1].any()
    assert back.usable()[:, [0, 2]].all()
    assert np.count_nonzero(~back.usable()) <= 22


def test_time_that_cannot_be_used() -> None:
    run = recorded()
    with pytest.raises(FileError, match="time stands still at 3"):
        equidistant(replace(run, t=np.full(len(run.t), 3.0)))
    with pytest.raises(FileError, match="has 5 samples; at least 10"):
        equidistant(run.cut(0, 5))
    scattered = rows_of(run, np.arange(len(run.t)) % 40 < 10)
    with pytest.raises(FileError, match=r"falls into 40 pieces.*too irregular"):
        equidistant(scattered)
