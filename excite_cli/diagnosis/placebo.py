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
from excite_cli.diagnosis.training import Columns, Shown, TrainingData
from excite_cli.out_of_core import Spool, forget
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

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
    at = white.columns(chosen)
    factor = white.factor(chosen)
    gains = []
    residuals = data.residuals(candidates, chosen, white.solve(chosen))
    local = [[c for c in candidates if c.rows == (j,) and c.width == 1] for j in range(data.n)]
    joints = [joint for joint in range(data.n) if local[joint]]
    sizes = [len(each) for each in data.tau]
    shifts = {
        joint: [
            [int(rng.integers(size // 4, max(3 * size // 4, 2))) for size in sizes]
            for _ in range(_SHIFTS)
        ]
        for joint in joints
    }
    # Two tasks a joint, as for the Gram matrices.
    halves = [half for half in np.array_split(np.arange(len(sizes)), 2) if len(half)]
    tasks = [
        (
            joint,
            [Shown(c.rows, c.columns, c.width) for c in local[joint]],
            half,
            [[of_parts[part] for part in half] for of_parts in shifts[joint]],
        )
        for joint in joints
        for half in halves
    ]
    taken = [candidates[i] for i in chosen]
    shared = data, [Shown(c.rows, c.columns, c.width) for c in taken], noise, residuals
    made = each(_products, shared, tasks)
    for _ in joints:
        for of_halves in zip(*(next(made) for _ in halves), strict=True):
            cross, square, product = (
                np.add.reduce(terms) for terms in zip(*of_halves, strict=True)
            )
            cross /= white.norms[at][:, None]
            left = square - np.einsum("ik,ik->k", cross, factor.solve(cross))
            good = left > 1e-2 * square
            gains += list(product[good] ** 2 / left[good])
    return np.array(gains)


def _products(
    shared: tuple[TrainingData, Sequence[Columns], NoiseModel, Sequence[Array]],
    task: tuple[int, Sequence[Columns], Sequence[int], Sequence[Sequence[int]]],
    tell: Tell,
) -> list[tuple[Array, Array, Array]]:
    """Of the columns of one joint, shifted: products with the model (k, L), with themselves (L,),
    and with the residual (L,), for every set of `shifts` of some parts."""
    data, taken, noise, residuals = shared
    joint, local, of_parts, shifts = task
    parts, spool = [], Spool()
    for part in of_parts:
        run = data.runs[part]
        columns = data.columns(taken, range(len(taken)), part, joint)
        whiten = noise.whitening(joint, run.usable[:, joint])
        own, rest = whiten(columns), whiten(residuals[part][:, joint])
        columns = np.stack([c.columns[part][:, 0, 0] for c in local], axis=1)
        parts.append((spool.keep(columns), spool.keep(own), rest, whiten))
        forget()
    found = []
    for moves in shifts:
        cross = np.zeros((parts[0][1].shape[1], len(local)))
        square, product = np.zeros(len(local)), np.zeros(len(local))
        for shift, (columns, own, rest, whiten) in zip(moves, parts, strict=True):
            moved = whiten(np.roll(columns, shift, axis=0))
            cross += own.T @ moved
            square += np.sum(moved**2, axis=0)
            product += rest @ moved
            forget()
        found.append((cross, square, product))
    return found
