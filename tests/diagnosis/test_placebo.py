"""Placebos find a noise model that promises too much, and leave a good one alone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.noise_model import NoiseModel, fit_noise
from excite_cli.diagnosis.placebo import placebo_gains, placebos_of
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.viscous_friction import ViscousFriction
from tests.diagnosis.explicit_data import FIXED, prepared

SAMPLES, PARTS, LOCAL = 500, 3, 8


def data_with_memory(memory: float, seed: int = 0) -> tuple[TrainingData, list[Candidate]]:
    """Slow columns and autoregressive noise on two joints; no candidate is in the torque."""
    rng = np.random.default_rng(seed)

    def slow(*shape: int) -> np.ndarray:
        return lfilter([1.0], [1.0, -0.95], rng.normal(size=shape), axis=0)

    usable = [rng.random((SAMPLES, 2)) > 0.01 for _ in range(PARTS)]
    declared = tuple(slow(SAMPLES, 2, FIXED) for _ in range(PARTS))
    noise = [lfilter([1.0], [1.0, -memory], rng.normal(size=(SAMPLES, 2)), axis=0) for _ in usable]
    tau = tuple(d @ np.ones(FIXED) + e for d, e in zip(declared, noise, strict=True))
    runs = tuple(prepared(u) for u in usable)
    candidates = [
        Candidate(
            ViscousFriction((joint,)), (joint,), tuple(slow(SAMPLES, 1, 1) for _ in range(PARTS))
        )
        for joint in (0, 1)
        for _ in range(LOCAL)
    ]
    return TrainingData(runs, (0, 1, 2), declared, tau), candidates


def inflation(data: TrainingData, candidates: list[Candidate], noise: NoiseModel) -> float:
    white = data.evidence(candidates, noise)
    return placebos_of(data, candidates, (), noise, white).inflation


def fitted(data: TrainingData) -> NoiseModel:
    plain = data.evidence([], NoiseModel.white(np.ones(2)))
    left = data.residuals([], (), plain.solve(()))
    return fit_noise(left, [run.usable for run in data.runs])


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_a_noise_model_that_fits_is_hardly_inflated(memory: float) -> None:
    data, candidates = data_with_memory(memory)
    assert 1.0 <= inflation(data, candidates, fitted(data)) < 1.5


def test_noise_taken_for_white_is_inflated() -> None:
    """Slow columns explain slow noise: the excess is the ratio of its spectrum at frequency zero
    to its variance, (1 + c)/(1 − c) = 19 and less where the columns are not that slow.
    """
    data, candidates = data_with_memory(0.9)
    plain = data.evidence([], NoiseModel.white(np.ones(2)))
    rest = np.concatenate(data.residuals([], (), plain.solve(())))
    found = inflation(data, candidates, NoiseModel.white(rest.std(axis=0)))
    assert 5.0 < found < 25.0
    # Few placebos say nothing.
    assert inflation(data, candidates[:1], NoiseModel.white(np.full(2, 0.1))) == 1.0


def test_gains_are_those_of_a_chi_square_law() -> None:
    data, candidates = data_with_memory(0.7, seed=4)
    noise = fitted(data)
    white = data.evidence(candidates, noise)
    gains = placebo_gains(data, candidates, (), noise, white)
    assert len(gains) == 6 * 2 * LOCAL
    assert np.mean(gains) == pytest.approx(1.0, abs=0.4)
    assert np.array_equal(gains, placebo_gains(data, candidates, (), noise, white))


def test_an_effect_that_is_in_the_model_is_not_in_the_residual() -> None:
    data, candidates = data_with_memory(0.0, seed=2)
    strong = tuple(
        tau + np.stack([20 * c[:, 0, 0], np.zeros(SAMPLES)], axis=1)
        for tau, c in zip(data.tau, candidates[0].columns, strict=True)
    )
    data = replace(data, tau=strong)
    noise = NoiseModel.white(np.ones(2))
    white = data.evidence(candidates, noise)
    without = placebos_of(data, candidates, (), noise, white).inflation
    assert without > 50
    assert placebos_of(data, candidates, (0,), noise, white).inflation < 1.7


def test_the_inflation_is_that_of_the_variance() -> None:
    """Noise of one that is taken for a half: every χ² is four times too large."""
    half = NoiseModel.white(np.full(2, 0.5))
    found = [inflation(*data_with_memory(0.0, seed), half) for seed in range(12)]
    assert np.mean(found) == pytest.approx(4.0, rel=0.2)
