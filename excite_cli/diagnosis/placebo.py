"""Placebos: the same columns, shifted in time, where they can explain nothing.

If the noise model were right, the energy that a shifted column explains would be χ² distributed
with one degree of freedom. Where it is more, tests promise too much, and every χ² is divided by the
excess. So many placebos say nothing of events rarer than one of them: no smaller p is told.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import Columns, PartColumns, TrainingData
from excite_cli.robot.model import Array
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

_SHIFTS = 6
_SEED = 20261121
_QUANTILE = 0.9
_FEWEST = 20


@dataclass(frozen=True)
class Placebos:
    """By how much shifted columns exceed χ², at least 1, and the least p that they back."""

    inflation: float
    least_p: float


def placebos_of(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    noise: NoiseModel,
    white: Evidence,
) -> Placebos:
    """What shifted columns of local candidates say of tests.

    The residual is that of the model with the `chosen` candidates.
    """
    found = placebo_gains(data, candidates, chosen, noise, white)
    least = 1.0 / max(len(found), _FEWEST)
    if len(found) < _FEWEST:
        return Placebos(1.0, least)
    excess = np.quantile(found, _QUANTILE) / chi2.ppf(_QUANTILE, 1)
    return Placebos(float(max(1.0, excess)), least)


def placebo_gains(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    noise: NoiseModel,
    white: Evidence,
) -> Array:
    """χ² of every shifted column of a local candidate, given the model with those `chosen`."""
    rng = np.random.default_rng(_SEED)
    sizes = [len(tau) for tau in data.tau]
    tasks = []
    for joint in range(data.n):
        local = [c.columns for c in candidates if c.rows == (joint,) and c.width == 1]
        if local:
            shifts = [
                [int(rng.integers(size // 4, max(3 * size // 4, 2))) for size in sizes]
                for _ in range(_SHIFTS)
            ]
            tasks += [
                (joint, part, [columns[part] for columns in local], moves)
                for part, moves in enumerate(zip(*shifts, strict=True))
            ]
    at, factor = white.columns(chosen), white.factor(chosen)
    residuals = data.residuals(candidates, chosen, white.solve(chosen))
    taken = [PartColumns(candidates[i].rows, candidates[i].columns) for i in chosen]
    made = each(_products, (data, taken, noise, residuals), tasks)
    gains: list[float] = []
    for _ in range(len(tasks) // len(sizes)):
        for products in np.asarray(sum(next(made) for _ in sizes)):
            cross = products[:-2] / white.norms[at][:, None]
            product, square = products[-2], products[-1]
            left = square - np.einsum("ik,ik->k", cross, factor.solve(cross))
            good = left > 1e-2 * square
            gains += list(product[good] ** 2 / left[good])
    return np.array(gains)


def _products(
    shared: tuple[TrainingData, Sequence[Columns], NoiseModel, Sequence[Array]],
    task: tuple[int, int, Sequence[Array], Sequence[int]],
    tell: Tell,
) -> Array:
    """Products (shifts, k + 2, L) of L shifted columns of one joint's rows in one part.

    With the k columns of the model, with the residual, and with themselves.
    """
    data, taken, noise, residuals = shared
    joint, part, local, moves = task
    whiten = noise.whitening(joint, data.runs[part].usable[:, joint])
    model = whiten(data.columns(taken, range(len(taken)), part, joint))
    rest = whiten(residuals[part][:, joint])
    columns = np.concatenate([column[:, 0] for column in local], axis=1)
    found = np.empty((len(moves), model.shape[1] + 2, len(local)))
    for products, shift in zip(found, moves, strict=True):
        moved = whiten(np.roll(columns, shift, axis=0))
        products[:-2] = model.T @ moved
        products[-2] = rest @ moved
        products[-1] = np.sum(moved**2, axis=0)
    return found
