"""How near the URDF the consistent set stays: as near as the data let it.

Where nobody says what the URDF is worth, the prior about it is so wide that it decides nothing
that the data show. What they hardly show is then left to the noise and to the errors of the model,
which pull weak directions far away. So the prior is narrowed as long as the misfit of the data
stays what it was:

    ‖R x − z‖² ≤ ‖R x₁ − z‖² + 9

R, z are in units of each joint's noise, so that the fit is worse by no more than three standard
deviations of independent noise; x₁ is the fit with the prior as it was given. First all deviations
are multiplied by s, in steps; the misfit only grows as s falls, hence the first step that is too
much ends this. Then links that still differ much are held one by one, the farthest first, wholly
or, where the data do not let that be, in their mass.
"""

from dataclasses import replace

import numpy as np

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.identification.consistent import ConsistentParameters, consistent_parameters
from excite_cli.identification.factors import Mask
from excite_cli.identification.prior import InertialPrior
from excite_cli.robot.model import Array

_SPREADS = (0.7, 0.5, 0.35, 0.25, 0.18, 0.13, 0.1, 0.07, 0.05)
# Three standard deviations, squared.
CLEARLY_WORSE = 9.0
# A link is held with this share of the prior's deviations if a parameter is off by more than `_FAR`
# of them, or its mass of itself; so many links at most, as every trial is a program to solve.
_HELD, _FAR, _TRIALS = 0.25, 0.5, 12


def consistent_near_prior(
    factor: Array,
    base: BaseParameters,
    prior: InertialPrior,
    lengths: Array,
    nonnegative: Mask,
) -> ConsistentParameters:
    """The set nearest to the prior's mean that the data allow; as `consistent_parameters`.

    `spread` of it is the s of the module's text.
    """
    found = consistent_parameters(factor, base, prior, lengths, nonnegative)
    if not found.solved:
        return found
    allowed = found.cost + CLEARLY_WORSE

    def narrowed(shares: Array) -> ConsistentParameters | None:
        tried = consistent_parameters(factor, base, prior.narrowed(shares), lengths, nonnegative)
        return tried if tried.solved and tried.cost <= allowed else None

    shares = np.ones(len(prior.std))
    for spread in _SPREADS:
        nearer = narrowed(np.full(len(shares), spread))
        if nearer is None:
            break
        found = replace(nearer, spread=spread)
        shares[:] = spread
    # Deviations of light links are several times their mass.
    light = np.clip(prior.mean[::10] / prior.std[::10], 0.1, 1.0)
    untried = set(range(len(lengths))) if shares[0] > _HELD else set()
    for _ in range(_TRIALS):
        body = _farthest(found.phi, prior, untried)
        if body is None:
            break
        untried.remove(body)
        for width in (10, 1):  # all of the link, or its mass
            trial = shares.copy()
            trial[10 * body : 10 * body + width] = _HELD
            trial[10 * body] = _HELD * light[body]
            nearer = narrowed(trial)
            if nearer is not None:
                found, shares = replace(nearer, spread=found.spread), trial
                break
    return found


def _farthest(phi: Array, prior: InertialPrior, bodies: set[int]) -> int | None:
    """The one of `bodies` that is farthest from the prior's mean; None if all are near."""
    change = np.abs(phi - prior.mean).reshape(-1, 10)
    mass = prior.mean[::10]
    relative = np.where(mass > 0, change[:, 0] / np.where(mass > 0, mass, 1.0), 0.0)
    off = np.maximum((change / prior.std.reshape(-1, 10)).max(axis=1), relative)
    far = [body for body in bodies if off[body] > _FAR]
    return max(far, key=lambda body: float(off[body])) if far else None
