"""Recorded speeds that contradict the positions: a clock that is off, a filter, a delay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.measurement.dataset import Run
from excite_cli.measurement.speeds import check_clock
from tests.measurement.recordings import check, motion, only, read, recorded, write_csv


def filtered(run: Run, seconds: float) -> Run:
    """With the change of position behind a first-order filter as speed."""
    dq = np.gradient(run.q, run.step, axis=0)
    keep = np.exp(-run.step / seconds)
    return replace(run, dq=lfilter([1 - keep], [1, -keep], dq, axis=0, zi=keep * dq[:1])[0])


@pytest.mark.parametrize("factor", [0.9, 1.25])
def test_a_clock_that_is_off_is_told_with_its_key(factor: float, tmp_path: Path) -> None:
    run = recorded()
    wrong = replace(run, t=run.t * factor)
    found = only(check(wrong)[1], "clock")
    assert found.severity == "warning"
    assert f"measurement.clock: {1 / factor:.3g}" in found.text
    data = read(write_csv(tmp_path / "log.csv", wrong), clock=1 / factor)
    assert data.findings == ()
    np.testing.assert_allclose(data.runs[0].t, run.t, atol=1e-12)


def test_gains_that_differ_are_no_clock() -> None:
    run = recorded()
    assert run.dq is not None
    assert check(replace(run, dq=run.dq * [0.95, 0.9, 1]))[1] == []


@pytest.mark.parametrize("seconds", [0.05, 0.2])
def test_a_filter_of_the_speeds_is_told_with_its_time_constant(seconds: float) -> None:
    slow = filtered(recorded(), seconds)
    found = only(check(slow)[1], "lag")
    assert f"first-order low-pass of {seconds:.3g} s" in found.text
    assert "not used" in found.text
    assert "{dq: null}" in found.text
    used = only(check(slow, filter={"velocity": "measured"})[1], "lag")
    assert "write differentiated" in used.text


def test_a_delay_is_no_filter() -> None:
    run = recorded()
    late = replace(run, dq=motion(run.t - 0.04)[1])
    assert "40 ms after" in only(check(late)[1], "lag").text


def clocked(step: float, gain: float) -> Run:
    """Two joints, the second faster, with a sample every `step` and speeds too large by `gain`."""
    k, period = np.arange(400), np.array([200.0, 130.0])
    phase = 2.0 * np.pi * k[:, None] / period
    dq = gain * np.cos(phase) * 2.0 * np.pi / (period * step)
    return Run("a", step * k, np.sin(phase), np.zeros((400, 2)), dq)


def test_only_one_factor_on_all_joints_is_a_clock() -> None:
    (found,) = check_clock([clocked(0.01, 1.05)], "a")
    assert "measurement.clock: 0.95" in found.text
    (found,) = check_clock([clocked(1.0, 100.0)], "a")  # stamps that count samples
    assert found.severity == "error"
    assert found.settings == {"measurement.clock": pytest.approx(0.01)}
    # Steps of which 0.1 s hold more than a number can say, as of damaged stamps.
    tiny = replace(clocked(0.01, 1.0), t=1e-310 * np.arange(400))
    for none in (clocked(0.01, 1.0), clocked(0.01, 0.0), clocked(0.7, 100.0), tiny):
        assert check_clock([none], "a") == []
