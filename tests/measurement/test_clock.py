"""Recorded speeds against the change of position."""

import numpy as np
import pytest

from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import RunId
from excite_cli.measurement.speeds import check_clock


def _run(step: float, gain: float) -> Run:
    t = step * np.arange(400)
    phase = 2.0 * np.pi * np.arange(400)[:, None] / (200.0, 130.0)
    speed = 2.0 * np.pi / (200.0 * step), 2.0 * np.pi / (130.0 * step)
    dq = gain * np.cos(phase) * speed
    return Run(RunId("a"), t, np.sin(phase), np.zeros((400, 2)), dq)


def test_one_factor_on_all_joints_is_told() -> None:
    (finding,) = check_clock([_run(0.01, 1.05)], "a")
    assert "measurement.clock: 0.95" in finding.text


@pytest.mark.parametrize("gain", [1.0, 0.0])
def test_no_factor_is_none(gain: float) -> None:
    assert check_clock([_run(0.01, gain)], "a") == []


def test_steps_without_a_window_are_read() -> None:
    """Damaged stamps may leave steps of which 0.1 s hold more than a number can say."""
    run = _run(0.01, 1.0)
    tiny = Run(run.id, 1e-310 * np.arange(400), run.q, run.tau, run.dq)
    assert check_clock([tiny], "a") == []  # so far off is no clock


def test_stamps_that_count_samples() -> None:
    (finding,) = check_clock([_run(1.0, 100.0)], "a")
    assert finding.severity == "error"
    assert finding.settings == {"measurement.clock": pytest.approx(0.01)}
    assert check_clock([_run(0.7, 100.0)], "a") == []
