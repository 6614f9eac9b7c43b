"""Filtering, differentiation, averages and masks, against motions that are known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.errors import FileError
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Array, Run

STEP_OF_ENCODER = 2e-5


def fourier(t: Array) -> tuple[Array, Array, Array]:
    """q, v, a of two joints, five harmonics of 0.2 Hz."""
    rng = np.random.default_rng(3)
    w = 2 * np.pi * 0.2 * np.arange(1, 6)[:, None, None]
    size, phase = rng.uniform(0.1, 0.3, (5, 1, 2)), rng.uniform(0, 6, (5, 1, 2))
    inside = w * t[:, None] + phase
    q = (size * np.sin(inside)).sum(0)
    return q, (size * w * np.cos(inside)).sum(0), (-size * w**2 * np.sin(inside)).sum(0)


def recorded(fs: float = 500.0, seconds: float = 10.0, encoder: float = STEP_OF_ENCODER) -> Run:
    """The torque is a known smooth function of the motion."""
    t = np.arange(0, seconds, 1 / fs)
    q, v, a = fourier(t)
    tau = 3 * a + 2 * v + np.cos(q)
    return Run("r", t, np.round(q / encoder) * encoder if encoder else q, tau, dq=v)


def ready(run: Run, **given: object) -> PreparedRun:
    spec = FilterSpec(**given)  # type: ignore[arg-type]
    return prepare(run, choose_processing([run], spec))


def relative(x: Array, truth: Array) -> float:
    return float(np.sqrt(np.mean((x - truth) ** 2) / np.mean(truth**2)))


@pytest.mark.parametrize("fs", [100.0, 500.0, 1000.0])
def test_motion_is_recovered_through_the_encoder(fs: float) -> None:
    found = ready(recorded(fs))
    q, v, a = fourier(found.t)
    assert relative(found.q, q) < 1e-4
    assert relative(found.v, v) < 2e-3
    assert relative(found.a, a) < 2e-2
    assert relative(found.averaged(found.a), found.averaged(a)) < 1e-2
    assert relative(found.averaged(found.tau_raw), found.tau) < 1e-3, "at both rates"
    exact = ready(recorded(fs, encoder=0.0))
    _, v, a = fourier(exact.t)
    assert abs(np.sum((v - exact.v) * a) / np.sum(a**2)) < 1e-5, "no shift in time [s]"


@pytest.mark.parametrize("fs", [100.0, 500.0, 997.0])
@pytest.mark.parametrize("given", [{}, {"parallel": "none"}, {"rate": 10.0}, {"position": "none"}])
def test_torque_and_columns_are_averaged_around_the_same_instants(
    fs: float, given: dict[str, object]
) -> None:
    """A torque that is the time itself tells the centres of the averages."""
    run = recorded(fs)
    run = replace(run, tau=np.stack([run.t, 5 - run.t], axis=1))
    found = ready(run, **given)
    centers = found.averaged(found.t)
    assert found.tau[:, 0] == pytest.approx(centers, abs=1e-12)
    assert found.tau[:, 1] == pytest.approx(5 - centers, abs=1e-12)
    assert np.diff(centers) == pytest.approx(found.step, abs=1e-12)


def test_averaging_commutes_with_the_linear_model() -> None:
    """Of all samples, and of those that fits use."""
    found = ready(recorded())
    rng = np.random.default_rng(0)
    columns, x = rng.normal(size=(len(found.t), 2, 7)), rng.normal(size=7)
    for average in (found.averaged, found.averaged_for_fit):
        left = average(columns) @ x
        assert left.shape == found.tau.shape
        assert np.abs(left - average(columns @ x)).max() < 1e-12
    assert found.averaged(np.ones(len(found.t))) == pytest.approx(1.0, abs=1e-13)
    second = found.averaged_for_fit(columns[:, 1:], [1])
    assert np.array_equal(second, found.averaged_for_fit(columns)[:, 1:])


def test_averages_lower_white_noise_without_folding_it() -> None:
    """Noise of the torque falls by the square root of the samples that are averaged."""
    run = recorded(1000.0, 30.0)
    noise = np.random.default_rng(1).normal(size=run.tau.shape)
    processing = choose_processing([run], FilterSpec(parallel=6.0))
    found = prepare(replace(run, tau=noise), processing)
    width = np.sqrt(np.log(2.0)) / (2 * np.pi * 6.0) * 1000.0  # samples
    expected = 1 / np.sqrt(2 * np.sqrt(np.pi) * width)
    assert found.tau.std() == pytest.approx(expected, rel=0.1)


def test_borders_are_cut_and_measured_speeds_used_when_asked_for() -> None:
    run = recorded()
    found = ready(run, border=1.0)
    assert found.t[0] == pytest.approx(1.0)
    assert found.t[-1] <= run.t[-1] - 1.0 + 1e-9
    assert found.t[-1] > run.t[-1] - 1.02
    centers = found.averaged(found.t)
    assert centers[0] > 1.0
    assert centers[-1] < run.t[-1] - 1.0
    # Measured speeds are used when asked for.
    run = recorded(encoder=0.0)
    assert run.dq is not None
    found = ready(replace(run, dq=2 * run.dq), velocity="measured")
    _, v, a = fourier(found.t)
    assert relative(found.v, 2 * v) < 1e-3
    assert relative(found.a, 2 * a) < 5e-3


@pytest.mark.parametrize("fs", [100.0, 500.0, 997.0])
def test_what_fits_leave_out_they_leave_out_of_torque_and_columns_alike(fs: float) -> None:
    """Samples are left out around reversals and where they are not valid: no lag comes of it."""
    run = recorded(fs)
    hole = np.ones(run.tau.shape, bool)
    hole[int(3 * fs) : int(3.1 * fs), 1] = False
    timed = ready(replace(run, tau=np.stack([run.t, run.t], axis=1), valid=hole))
    centers = timed.averaged_for_fit(np.stack([timed.t, timed.t], axis=1))
    assert not np.allclose(centers, timed.averaged(timed.t)[:, None], atol=1e-3)
    assert timed.tau_fit[timed.usable] == pytest.approx(centers[timed.usable], abs=1e-9)
    found = ready(replace(run, valid=hole))
    modelled = found.averaged_for_fit(found.tau_raw)[found.usable]
    assert relative(modelled, found.tau_fit[found.usable]) < 1e-5


def test_an_invalid_sample_costs_its_weight_and_touches_nothing() -> None:
    """Every window that holds one goes on with the rest, torque and prediction alike."""
    run = recorded()
    bad = np.zeros(run.tau.shape, bool)
    bad[::60, 0] = bad[3300:3350, 1] = True
    clean = ready(run)
    spoilt, worse = (
        ready(replace(run, tau=np.where(bad, size, run.tau), valid=~bad)) for size in (1e3, -1e9)
    )
    assert spoilt.valid[:, 0].all()
    assert 0 < np.count_nonzero(~spoilt.valid[:, 1]) < 20
    assert np.array_equal(spoilt.tau, worse.tau)
    assert np.array_equal(spoilt.tau_fit, worse.tau_fit)
    assert not (spoilt.usable & ~clean.usable).any()
    assert np.count_nonzero(~spoilt.usable) < 1.3 * np.count_nonzero(~clean.usable) + 20
    right = spoilt.averaged_torque(run.tau[np.searchsorted(run.t, clean.t)])
    assert np.abs(right - spoilt.tau)[spoilt.valid].max() < 1e-3 * np.abs(clean.tau).max()


def test_what_sticks_around_a_reversal_counts_in_no_fit() -> None:
    """Also without a filter of the positions, which smears reversals and widens what is left out:
    15 ms around a reversal the friction may be anything."""
    t = np.arange(0, 10, 1e-3)
    v = np.where(np.sin(2 * np.pi * 0.3 * t + 0.4) >= 0, 0.5, -0.5)
    reversals = t[1:][np.diff(v) != 0]
    near = np.abs(t[:, None] - reversals).min(axis=1) < 0.015
    tau = np.where(near, 1000.0, np.sign(v))
    run = Run("r", t, np.cumsum(v)[:, None] * 1e-3, tau[:, None], dq=v[:, None])
    found = ready(run, position="none", velocity="measured")
    assert len(reversals) == 6
    assert np.abs(found.tau).max() > 10
    assert found.usable.mean() > 0.9
    assert np.abs(found.tau_fit[found.usable]).max() < 1 + 1e-9


def test_a_standstill_is_not_usable_and_a_reversal_hardly() -> None:
    run = recorded(encoder=0.0)
    stop = (run.t > 4) & (run.t < 6)
    q = run.q.copy()
    q[stop, 0] = q[np.flatnonzero(stop)[0], 0]
    q[run.t >= 6, 0] += q[np.flatnonzero(stop)[0], 0] - q[np.flatnonzero(run.t >= 6)[0], 0]
    found = ready(replace(run, q=q))
    centers = found.averaged(found.t)
    still = (centers > 4.3) & (centers < 5.7)
    assert found.valid.all()
    assert not found.usable[still, 0].any()
    assert not found.moving[still, 0].any()
    _, v, _ = fourier(found.t)
    reversals = centers[:-1][np.diff(np.sign(found.averaged(v[:, 1]))) != 0]
    far = np.abs(centers[:, None] - reversals).min(axis=1) > 0.15
    assert found.usable[far, 1].all()
    assert found.usable[:, 1].mean() > 0.85
    assert not found.moving[:, 1].all()  # it does pass through zero


@pytest.mark.parametrize(("seconds", "seen"), [(0.016, False), (0.03, True)])
def test_what_a_joint_does_while_it_sticks_takes_no_part_in_fits(
    seconds: float, seen: bool
) -> None:
    """A torque so long before and after every reversal, whatever the speed; no filter smears it."""
    run = recorded(encoder=0.0)
    _, v, _ = fourier(run.t)
    turns = [run.t[1:][np.signbit(x[1:]) != np.signbit(x[:-1])] for x in v.T]
    near = [np.abs(run.t[:, None] - at).min(axis=1) < seconds for at in turns]
    run = replace(run, tau=np.stack(near, axis=1).astype(float))
    found = prepare(run, choose_processing([run], FilterSpec(position="none"), 1e-3))
    assert found.tau.max() > 0.1
    for j in range(2):
        assert found.tau_fit[found.usable[:, j], j].any() == seen


def test_runs_too_short_or_too_slow_are_refused_in_words() -> None:
    """Cut-offs are chosen from the training runs; the held-out one may have another rate."""
    run = recorded()
    processing = choose_processing([run], FilterSpec())
    with pytest.raises(FileError, match=r"run 'brief' is too short: 0\.598 s leave \d averaged"):
        prepare(replace(run, name="brief").cut(0, 300), processing)
    with pytest.raises(FileError, match="only 9 samples"):
        prepare(replace(run, name="brief").cut(0, 9), processing)
    fine = choose_processing([run], FilterSpec(position=30.0))
    with pytest.raises(FileError, match=r"run 'r' was recorded at 50 Hz: too slow .* 30 Hz"):
        prepare(recorded(50.0), fine)
