"""Weighted least squares from Gram matrices, beside the fit that `identify` makes of the rows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.training import TrainingData
from excite_cli.diagnosis.weighted_fit import WeightedFit
from excite_cli.identification.least_squares import EXACT, fit_rows
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import FIXED, PRIOR, random_candidates, random_data

MODELS = ((), (0,), (1, 2), (0, 1, 3, 4))


@pytest.mark.parametrize("chosen", MODELS)
@pytest.mark.parametrize("seed", [1, 2])
def test_it_is_the_fit_of_identify(chosen: tuple[int, ...], seed: int) -> None:
    data, candidates = random_data(seed), random_candidates(seed)
    data = _with(data, tuple(tau * [1.0, 7.0] for tau in data.tau))  # joints of unequal noise
    found = WeightedFit(data, candidates)(chosen)[0]
    rows = data.rows(candidates, chosen)
    assert found == pytest.approx(fit_rows(rows, "wls").x, rel=1e-9, abs=1e-12)


def test_sigma_is_what_is_left_for_each_degree_of_freedom() -> None:
    """σ_j² = Σ r² / (N_j (1 − k / N)): every joint pays its share of the k parameters."""
    data, candidates, chosen = random_data(6), random_candidates(6), [0, 1, 3]
    parameters, sigma = WeightedFit(data, candidates)(chosen)
    squares, counts = np.zeros(2), np.zeros(2)
    for left, run in zip(data.residuals(candidates, chosen, parameters), data.runs, strict=True):
        squares += np.where(run.usable, left**2, 0.0).sum(axis=0)
        counts += run.usable.sum(axis=0)
    expected = np.sqrt(squares / counts / (1.0 - len(parameters) / counts.sum()))
    assert sigma == pytest.approx(expected, rel=1e-3)
    # Of data without noise sigma is the rounding of the torque.
    data, candidates = random_data(7), random_candidates(7)
    data = _with(data, tuple(own @ np.array([1e3, 2e3, -1e3, 5e2]) for own in data.declared))
    sigma = WeightedFit(data, candidates)([])[1]
    level = np.sqrt(np.mean(np.concatenate(data.tau) ** 2, axis=0))
    assert sigma == pytest.approx(EXACT * level, rel=0.2)


def test_a_prior_holds_what_it_knows_and_what_is_held_is_left_out() -> None:
    data, candidates = random_data(3, 1e4 * PRIOR), random_candidates(3)
    found = WeightedFit(data, candidates)([0])[0]
    known = PRIOR[:, :FIXED].any(axis=0)
    assert found[:FIXED][known] == pytest.approx(np.zeros(known.sum()), abs=1e-3)
    assert np.abs(found[:FIXED][~known]).min() > 1e-3
    # What is held is left out. The others are those of a model of the torque that is left, without
    # their columns.
    data, candidates = random_data(4), random_candidates(4)
    held = np.array([0.3, 2.0, -1.0, 0.5])
    found = WeightedFit(data, candidates)([1, 2], held)[0]
    bare = random_data(4)
    left = tuple(tau - own @ held for tau, own in zip(bare.tau, bare.declared, strict=True))
    bare = _with(bare, left, tuple(each[:, :, :0] for each in bare.declared))
    assert found[:FIXED] == pytest.approx(held)
    assert found[FIXED:] == pytest.approx(WeightedFit(bare, candidates)([1, 2])[0], rel=1e-9)


def usual_motion(seed: int, samples: int = 40) -> Array:
    """Columns (T, 2, k) of all candidates along a motion."""
    candidates = random_candidates(seed)
    ends = FIXED + np.cumsum([0, *(each.width for each in candidates)])
    found = np.zeros((samples, 2, ends[-1]))
    rng = np.random.default_rng([seed, 11])
    found[:, :, :FIXED] = rng.normal(size=(samples, 2, FIXED)) * [1, 5, 0.1, 2]
    for each, start in zip(candidates, ends, strict=False):
        own = rng.normal(size=(samples, len(each.rows), each.width))
        found[:, each.rows, start : start + each.width] = own
    return found


def beside_imagined(seed: int, plain: tuple[int, ...]) -> WeightedFit:
    columns = usual_motion(seed)
    usual = np.einsum("tjp,tjq->jpq", columns, columns) / len(columns)
    return WeightedFit(random_data(seed), random_candidates(seed), usual, plain)


def test_imagined_samples_say_what_the_textbooks_model_says() -> None:
    """Row by row: each of the usual motion's weighs a share of the data's, by the plain error."""
    seed, chosen, plain = 1, [0, 1, 2, 3], (0, 1)
    data, candidates = random_data(seed), random_candidates(seed)
    fit = beside_imagined(seed, plain)
    sigma = np.array([0.8, 1.3])
    found = fit(chosen, near=sigma)[0]
    x_plain, of_plain = WeightedFit(data, candidates)(plain)
    rows, said = [], []
    for run in data.rows(candidates, chosen):
        for joint in range(2):
            usable = run.usable[:, joint]
            rows.append(run.columns[usable, joint] / sigma[joint])
            said.append(run.tau[usable, joint] / sigma[joint])
    counts = sum(run.usable.sum(axis=0) for run in data.runs)
    every = usual_motion(seed)
    at = np.arange(FIXED + sum(candidates[i].width for i in chosen))
    x_plain = np.append(x_plain, np.zeros(len(at) - len(x_plain)))
    for joint in range(2):
        weight = np.sqrt(rules.IMAGINED * counts[joint] / len(every)) / of_plain[joint]
        rows.append(weight * every[:, joint, at])
        said.append(weight * every[:, joint, at] @ x_plain)
    expected = np.linalg.lstsq(np.concatenate(rows), np.concatenate(said), rcond=None)[0]
    assert found == pytest.approx(expected, rel=1e-8)
    assert found != pytest.approx(WeightedFit(data, candidates)(chosen, near=sigma)[0], rel=1e-4)


@pytest.mark.parametrize("chosen", [[0, 1, 3], [2], [1, 4]])
def test_rows_of_what_is_imagined_give_the_same(chosen: list[int]) -> None:
    data, candidates = random_data(2), random_candidates(2)
    fit = beside_imagined(2, (0, 1))
    for plain in ((), (0,), (0, 1)):  # nothing is imagined for the textbook's model
        assert len(fit.imagined(plain)[0]) == 0
        assert fit(plain)[0] == pytest.approx(WeightedFit(data, candidates)(plain)[0], rel=1e-12)
    rows = data.rows(candidates, chosen)
    found = fit_rows(rows, "wls", fit.imagined(chosen)).x
    assert found == pytest.approx(fit(chosen)[0], rel=1e-8, abs=1e-12)


def test_what_the_data_hardly_show_is_the_textbooks() -> None:
    """A column that is tiny in the data and large along the usual motion adds nothing there."""
    data, candidates = random_data(4), random_candidates(4)
    small = replace(candidates[2], columns=tuple(1e-3 * each for each in candidates[2].columns))
    candidates[2] = small
    columns = usual_motion(4)
    usual = np.einsum("tjp,tjq->jpq", columns, columns) / len(columns)
    free = WeightedFit(data, candidates)([0, 1, 2])[0][-2:]
    near = WeightedFit(data, candidates, usual, [0, 1])([0, 1, 2])[0][-2:]
    assert np.abs(free).max() > 10.0
    assert np.abs(near).max() < 0.02 * np.abs(free).max()


def test_what_is_imagined_takes_nothing_from_the_data() -> None:
    """What was found is in the data for sure, and the textbook's model has nothing of it."""
    data, candidates = random_data(1), random_candidates(1)
    found = [each[:, 0] @ [40.0, -40.0] for each in candidates[2].columns]
    tau = [t + np.column_stack([x, 0.0 * x]) for t, x in zip(data.tau, found, strict=True)]
    data, chosen, plain = _with(data, tuple(tau)), [1, 2, 3], (0, 1)
    free, left = WeightedFit(data, candidates)(chosen)
    columns = 100.0 * usual_motion(1)
    usual = np.einsum("tjp,tjq->jpq", columns, columns) / len(columns)
    fit = WeightedFit(data, candidates, usual, plain)
    assert 0.0 < fit._fitted(chosen, np.zeros(0), None)[0] < 1.0
    parameters, now = fit(chosen)
    assert (now <= rules.AS_GOOD * left).all()
    assert parameters[-3:-1] == pytest.approx([40.0, -40.0], rel=0.05)
    rows = fit_rows(data.rows(candidates, chosen), "wls", fit.imagined(chosen)).x
    assert rows == pytest.approx(parameters, rel=1e-6, abs=1e-9)
    # Where nothing can be imagined without harm, nothing is.
    alone = WeightedFit(data, candidates, 1e12 * usual, plain)
    assert alone(chosen)[0] == pytest.approx(free, rel=1e-12)
    assert len(alone.imagined(chosen)[0]) == 0


def _with(
    data: TrainingData, tau: tuple[Array, ...], declared: tuple[Array, ...] | None = None
) -> TrainingData:
    prior: dict[str, Any] = {} if declared is None else {"prior": None, "weighed": None}
    return replace(data, tau=tau, declared=declared or data.declared, **prior)


def test_what_the_data_do_not_have_no_rounding_of_the_usual_motion_tells() -> None:
    """A force along the axis of every joint was given 3e14 N so."""
    seed, lacking = 5, 2
    candidates = list(random_candidates(seed))
    own = candidates[lacking]
    candidates[lacking] = replace(own, columns=tuple(0.0 * each for each in own.columns))
    columns = usual_motion(seed)
    ends = FIXED + np.cumsum([0, *(each.width for each in candidates)])
    columns[:, :, ends[lacking] : ends[lacking + 1]] *= 1e-17
    usual = np.einsum("tjp,tjq->jpq", columns, columns) / len(columns)
    rows, _ = WeightedFit(random_data(seed), candidates, usual, (0,)).imagined((0, lacking))
    start = FIXED + candidates[0].width
    assert len(rows)
    assert not rows[:, start : start + own.width].any()
