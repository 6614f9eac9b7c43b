"""What coarse or rare positions cost, foretold from them and measured against the truth."""

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.identification.motion_errors import check_motion, motion_errors
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Run
from tests.measurement.recordings import JOINTS, motion


def moved(rate: float, count: float = 0.0, seconds: float = 12.0) -> Run:
    t = np.arange(int(seconds * rate)) / rate
    q = motion(t)[0]
    q = count * np.round(q / count) if count else q + 1e-9 * np.random.default_rng(0).normal(
        size=q.shape)  # fmt: skip
    return Run("run", t, q, np.cos(q))


def measured(run: Run) -> np.ndarray:
    """Relative errors (2, n) of the speeds and accelerations that are made of its positions."""
    processing = choose_processing([run], FilterSpec())
    made = prepare(run, processing)
    first = int(np.ceil(processing.border / run.step))
    t = run.t[first : len(run.t) - first : processing.working_stride]
    h = 1e-4
    true = [motion(t)[1], (motion(t + h)[1] - motion(t - h)[1]) / (2 * h)]
    pairs = zip((made.v, made.a), true, strict=True)
    return np.array([np.linalg.norm(x - y, axis=0) / np.linalg.norm(y, axis=0) for x, y in pairs])


def told(run: Run) -> dict[str, str]:
    processing = choose_processing([run], FilterSpec())
    return {each.kind: each.text for each in check_motion([run], processing, JOINTS)}


def test_slow_rates_and_coarse_positions() -> None:
    run = moved(12.0)
    errors = motion_errors([run], choose_processing([run], FilterSpec()))
    assert errors.lost == pytest.approx(measured(run), rel=0.5)
    text = told(run)["slow_rate"]
    assert "at 12 Hz" in text
    assert "Record at" in text
    assert "measurement.filter.position" in text
    # Coarse positions.
    run = moved(125.0, 2 * np.pi / 1024)
    errors = motion_errors([run], choose_processing([run], FilterSpec()))
    assert errors.counts == pytest.approx(2 * np.pi / 1024)
    assert errors.counted == pytest.approx(measured(run), rel=0.6)
    text = told(run)["coarse_positions"]
    assert "steps of 0.0061 rad" in text


@pytest.mark.parametrize(("rate", "count"), [(100.0, 0.0), (250.0, 2 * np.pi / 2**14), (1e3, 0.0)])
def test_usual_logs_are_not_doubted(rate: float, count: float) -> None:
    assert told(moved(rate, count)) == {}
