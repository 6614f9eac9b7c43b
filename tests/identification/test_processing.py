"""Cut-offs and rates chosen from positions of known bandwidth and noise."""

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.errors import ConfigError
from excite_cli.identification.processing import (
    GAUSSIAN,
    Processing,
    choose_processing,
)
from excite_cli.measurement.dataset import Run


def run_of(fs: float, top: float, seconds: float = 20.0, noise: float = 1e-5, seed: int = 0) -> Run:
    """Two joints whose fastest line is at `top` [Hz], with white noise on the positions."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / fs)
    lines = np.array([0.2, 0.5, 1.0]) * top
    q = np.stack([np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) / f for f in lines]).sum(0)
    q = q[:, None] * [1.0, 0.5] + noise * rng.normal(size=(len(t), 2))
    return Run("r", t, q, np.zeros_like(q))


def chosen(run: Run, **given: object) -> Processing:
    return choose_processing([run], FilterSpec(**given))  # type: ignore[arg-type]


@pytest.mark.parametrize("top", [0.5, 1.0, 2.0])
def test_bandwidth_is_that_of_the_fastest_line(top: float) -> None:
    found = chosen(run_of(500.0, top))
    assert top <= found.bandwidth < top + 0.45  # two steps of the spectrum over 5 s


@pytest.mark.parametrize("fs", [100.0, 250.0, 1000.0])
@pytest.mark.parametrize("top", [0.5, 2.0])
def test_cutoffs_keep_the_motion_and_rates_keep_the_cutoffs(fs: float, top: float) -> None:
    found = chosen(run_of(fs, top))
    assert found.position_cutoff is not None
    assert found.parallel_cutoff is not None
    assert 4 * top <= found.position_cutoff <= fs / 5
    assert 2 * top <= found.parallel_cutoff <= fs / 5
    assert found.rate == pytest.approx(4 * found.parallel_cutoff)
    working = fs / found.working_stride
    assert working >= min(fs, 2.5 * found.position_cutoff)
    assert working >= found.rate
    assert found.recorded_rate == pytest.approx(fs)
    assert len(found.reasons) == 2


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_runs_of_several_rates_have_a_cutoff_that_the_slowest_can_bear(
    order: tuple[int, int, int],
) -> None:
    """The bandwidth is that of the motion, whatever the rate at which it was recorded."""
    runs = [run_of(fs, 5.0) for fs in (1000.0, 1000.0, 100.0)]
    found = choose_processing([runs[k] for k in order], FilterSpec())
    alone = choose_processing(runs[:2], FilterSpec())
    assert alone.position_cutoff is not None
    assert alone.position_cutoff > 20.0
    assert found.position_cutoff is not None
    assert found.position_cutoff <= 20.0
    assert found.bandwidth == pytest.approx(alone.bandwidth, abs=0.45)


def test_what_is_given_is_taken() -> None:
    found = chosen(run_of(500.0, 1.0), position=20.0, parallel=6.0, rate=30.0, border=0.7)
    assert (found.position_cutoff, found.parallel_cutoff) == (20.0, 6.0)
    assert (found.rate, found.border) == (30.0, 0.7)
    plain = chosen(run_of(500.0, 1.0), position="none", parallel="none")
    assert (plain.position_cutoff, plain.parallel_cutoff) == (None, None)
    assert (plain.rate, plain.working_stride) == (500.0, 1)
    # Measured speeds must be there.
    with pytest.raises(ConfigError, match="'measured' needs recorded speeds"):
        chosen(run_of(100.0, 1.0), velocity="measured")
    # More noise gives a lower cutoff of the positions.
    fine, coarse = (chosen(run_of(500.0, 1.0, noise=x)).position_cutoff for x in (1e-9, 1e-2))
    assert fine is not None
    assert coarse is not None
    assert coarse <= fine


def test_the_gaussian_is_3_db_down_at_its_cutoff() -> None:
    cutoff, h = 5.0, 1e-4
    t = np.arange(-0.5, 0.5, h)
    kernel = np.exp(-0.5 * (t * cutoff / GAUSSIAN) ** 2)
    response = abs(np.sum(kernel * np.exp(-2j * np.pi * cutoff * t))) / kernel.sum()
    assert response == pytest.approx(1 / np.sqrt(2), rel=1e-6)


@pytest.mark.parametrize("which", ["position", "parallel"])
def test_cutoffs_beyond_half_the_rate_are_refused(which: str) -> None:
    with pytest.raises(ConfigError, match=rf"filter\.{which}: 50 Hz is beyond half .*100 Hz"):
        chosen(run_of(100.0, 1.0), **{which: 50.0})
    assert getattr(chosen(run_of(100.0, 1.0), **{which: 49.0}), f"{which}_cutoff") == 49.0
