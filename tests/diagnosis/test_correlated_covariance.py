"""Standard deviations against the scatter of many fits to data with correlated noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.correlated_covariance import covariance_of
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.viscous_friction import ViscousFriction
from tests.diagnosis.explicit_data import FIXED, prepared

SAMPLES, DRAWS, MEMORY = 300, 600, 0.9
SIGMA = np.array([0.5, 2.0])


def design(seed: int = 0) -> tuple[TrainingData, list[Candidate]]:
    """Slow columns, for which correlated noise matters, and rows that are not usable."""
    rng = np.random.default_rng(seed)

    def slow(*shape: int) -> np.ndarray:
        return lfilter([1.0], [1.0, -0.9], rng.normal(size=shape), axis=0)

    usable = [rng.random((SAMPLES, 2)) > 0.1 for _ in range(2)]
    declared = tuple(slow(SAMPLES, 2, FIXED) * [1, 10, 0.1, 1] for _ in usable)
    zero = tuple(np.zeros((SAMPLES, 2)) for _ in usable)
    candidates = [
        Candidate(ViscousFriction((0,)), (0,), tuple(slow(SAMPLES, 1, 1) for _ in usable)),
        Candidate(ViscousFriction((0, 1)), (1, 0), tuple(slow(SAMPLES, 2, 1) for _ in usable)),
    ]
    runs = tuple(prepared(u) for u in usable)
    return TrainingData(runs, (0, 1), declared, zero), candidates


def noise(rng: np.random.Generator, memory: float) -> np.ndarray:
    white = rng.normal(size=(SAMPLES + 200, 2)) * SIGMA
    return lfilter([1.0], [1.0, -memory], white, axis=0)[200:]


@pytest.mark.parametrize("memory", [0.0, MEMORY])
def test_covariance_is_that_of_many_fits(memory: float) -> None:
    data, candidates = design()
    model = NoiseModel((np.array([memory]),) * 2, SIGMA)
    levels = SIGMA / np.sqrt(1 - memory**2)
    white = NoiseModel.white(levels)
    rng = np.random.default_rng(1)
    fits = []
    for _ in range(DRAWS):
        drawn = tuple(noise(rng, memory) for _ in data.tau)
        fits.append(replace(data, tau=drawn).evidence(candidates, white).solve((0, 1)))
    scatter = np.cov(np.array(fits).T)
    found = covariance_of(data, candidates, (0, 1), model, levels)
    assert np.sqrt(np.diag(found)) == pytest.approx(np.sqrt(np.diag(scatter)), rel=0.12)
    scale = np.sqrt(np.diag(scatter))
    assert found / np.outer(scale, scale) == pytest.approx(
        scatter / np.outer(scale, scale), abs=0.2
    )
    if memory:  # what independent samples would promise is far too little
        naive = covariance_of(data, candidates, (0, 1), NoiseModel.white(levels), levels)
        assert (np.diag(naive) < 0.5 * np.diag(found)).all()


@pytest.mark.parametrize("weighed", [False, True])
def test_what_is_known_before_counts(weighed: bool) -> None:
    """Inertias are drawn from it; the estimate's error has the covariance that is told.

    A prior on each, or on what was weighed: sums of several, of a target that is not zero.
    """
    data, candidates = design(3)
    rows, target = np.diag([10.0, 100.0, 5.0**0.5, 1000.0**0.5]), np.zeros(FIXED)
    if weighed:
        rows *= 10.0  # as certain as the data
        rows[1, :3], rows[3, 1:] = (400.0, 900.0, -30.0), (900.0, 10.0, 300.0)
        target = np.array([30.0, -4.0, 100.0, 7.0])
    both = np.column_stack([rows, target])
    data = replace(data, prior=both.T @ both)
    levels = SIGMA / np.sqrt(1 - MEMORY**2)
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(DRAWS):
        inertias = np.linalg.solve(rows, target + rng.normal(size=FIXED))
        truth = np.concatenate([inertias, [0.0]])
        drawn = tuple(d @ truth[:FIXED] + noise(rng, MEMORY) for d in data.declared)
        found = replace(data, tau=drawn).evidence(candidates, NoiseModel.white(levels)).solve((0,))
        errors.append(found - truth)
    model = NoiseModel((np.array([MEMORY]),) * 2, SIGMA)
    covariance = covariance_of(data, candidates, (0,), model, levels)
    scatter = np.std(np.array(errors), axis=0)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(scatter, rel=0.12)
    assert (np.abs(np.mean(errors, axis=0)) < 4.0 * scatter / np.sqrt(DRAWS)).all()
