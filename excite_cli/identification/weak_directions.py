"""Directions of the base parameters that the data hardly show: there the URDF's values are kept.

A joint that stands still, or one that hardly moves, leaves combinations of parameters that noise
alone decides, however large they come out. In units of what the URDF is worth if every standard
parameter may be off by its own size (`InertialPrior`), A φ_B − b ~ N(0, 1), the data fix them with
covariance Z = A C Aᵀ. Eigenvectors u of Z with a variance above one are known better from the
URDF, and its rows uᵀA φ_B = uᵀb join the fit, at what the URDF is taken to be worth
(`identification.uncertainty`): unless the data say for sure that the URDF is wrong there, by no
more than a placeholder can be. Where all that matters moves there are none.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.identification.least_squares import LinearFit
from excite_cli.identification.prior import InertialPrior
from excite_cli.robot.model import Array

# Standard deviation, in usual sizes, of a parameter that the data do not show at all.
_UNSEEN = 1e3
_WORSE = 1.0  # variance, in those of the URDF
# Standard deviations of the data by which the URDF is wrong for sure; and of its own by which no
# URDF is, so that the data must be.
_SURELY, _ABSURD = 5.0, 1e3


@dataclass(frozen=True)
class WeakDirections:
    """Rows [A b] (d, r+1) of d directions in units of standard deviations; `deviations` (r,).

    The latter are those of the base parameters by the data alone, in usual sizes; `alone` is that
    fit.
    """

    rows: Array
    deviations: Array
    alone: LinearFit


def weak_directions(
    linear: LinearFit, base: BaseParameters, prior: InertialPrior
) -> WeakDirections:
    """What a fit by data alone knows worse than `prior`; base parameters come first in `linear`."""
    rank = base.rank
    usual = np.sqrt(np.square(base.mapping) @ np.square(prior.std))
    covariance = linear.covariance[:rank, :rank].copy()
    unseen = ~linear.seen[:rank]
    covariance[unseen], covariance[:, unseen] = 0.0, 0.0
    covariance[unseen, unseen] = np.square(_UNSEEN * usual[unseen])
    whiten, target = prior.on_base(base)
    variances, vectors = np.linalg.eigh(whiten @ covariance @ whiten.T)
    off = np.abs(vectors.T @ (whiten @ linear.x[:rank] - target))
    certain = (off > _SURELY * np.sqrt(np.maximum(variances, 0.0))) & (off < _ABSURD)
    weak = vectors[:, (variances > _WORSE) & ~certain].T
    rows = np.column_stack([weak @ whiten, weak @ target])
    return WeakDirections(rows, np.sqrt(np.diag(covariance)) / usual, linear)
