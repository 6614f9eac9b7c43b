"""What a diagnosis will make of an effect of known size, before it is tried.

With G = CᵀC of the recordings and k the columns that an effect p is tried beside, both as in
`power.py`, let S = G − G_·k (G_kk + P)⁻¹ G_k·, and z the parameters of p in prior deviations. Of its
torque nothing in k imitates the energy λ = zᵀ S_pp z [χ²]. It is named with the probability

    Φ(√λ − √c) + Φ(−√λ − √c),

c its price, unless ν √(λ/N), a share of the torque's RMS, is below `rules.SMALLEST`: ν is the noise
of a sample as such a share, N the number of samples. Another effect d cannot imitate

    E = zᵀ (S_pp − S_pd S_dd⁻¹ S_dp) z

of it. Of a robot that has p, what p saves beyond d is about N(E, 4 E), so that p is preferred with
the probability Φ((E + c_d − c_p) / 2√E). Where base parameters and declared effects alone leave
less than 0.1 % of the energy of p, inertias take it up, and a diagnosis lists it as such.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.power import RIDGE, TEXTBOOK, chance, price
from excite_cli.diagnosis.schur import ABSORBED
from excite_cli.effects.base import Effect
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.prediction import Prediction
from excite_cli.robot.model import Array

_NOTHING = 1e-12  # of an energy: rounding


@dataclass(frozen=True)
class Foreseen:
    """Probabilities that an effect is `named`, and preferred to its nearest `rival` (`apart`).

    `absorbed`: inertias take it up; `rival`: kind and joints, by number; () where there is none.
    """

    named: float
    apart: float = 1.0
    absorbed: bool = False
    rival: tuple[str, tuple[int, ...]] | None = None


def foresee(
    prediction: Prediction,
    stack: Stack,
    significance: float,
    effect: Effect,
    values: Array,
    noise: float,
) -> Foreseen:
    """For `effect`, one of the prediction's, with its parameters `values` in their units.

    `noise`: ν of the module, that of the rows in `stack`.
    """
    own = prediction.extension.effects.index(effect)
    slices = prediction.extension.columns().slices
    blocks = [np.arange(part.start, part.stop) + prediction.rank for part in slices]
    p, gram = blocks[own], stack.factor.T @ stack.factor
    z = values / prediction.extension.scales[p - prediction.rank]
    declared, beside = [np.arange(prediction.rank)], [np.arange(prediction.rank)]
    rivals: list[int] = []
    for at, each in enumerate(prediction.extension.effects):
        if at < prediction.declared:
            declared.append(blocks[at])
        if at == own:
            continue
        if at < prediction.declared or each.kind in TEXTBOOK:
            beside.append(blocks[at])
        elif len(blocks[at]) <= len(p) and effect.kind not in each.refines:
            rivals.append(at)
    bare = _left(gram, np.concatenate(declared), prediction.rank)[p[0], p[0]]
    if not effect.refines and bare <= ABSORBED * gram[p[0], p[0]]:
        return Foreseen(0.0, absorbed=True)
    left = _left(gram, np.concatenate(beside), prediction.rank)
    energy, cost = float(z @ left[np.ix_(p, p)] @ z), price(type(effect), significance)
    samples = max(1.0, stack.rows / len(prediction.usual))
    if not energy > 0.0 or noise * np.sqrt(energy / samples) < rules.SMALLEST:
        return Foreseen(0.0)
    preferred: list[tuple[float, int]] = []
    for at in rivals:
        d = blocks[at]
        solved = np.linalg.lstsq(left[np.ix_(d, d)], left[np.ix_(d, p)] @ z, rcond=1e-6)[0]
        alone = max(energy - float(z @ left[np.ix_(p, d)] @ solved), _NOTHING * energy)
        dearer = price(type(prediction.extension.effects[at]), significance) - cost
        preferred.append((float(norm.cdf(0.5 * (alone + dearer) / np.sqrt(alone))), at))
    named = chance(float(np.sqrt(energy)), cost)
    if not preferred:
        return Foreseen(named)
    apart, at = min(preferred)
    rival = prediction.extension.effects[at]
    return Foreseen(named, apart, rival=(rival.kind, rival.joints))


def _left(gram: Array, beside: Array, rank: int) -> Array:
    """S (c, c): what the columns `beside`, of which the first `rank` are inertias, leave of all."""
    known = gram[np.ix_(beside, beside)] + np.diag(np.where(beside < rank, 0.0, 1.0))
    known[np.diag_indices(rank)] *= 1.0 + RIDGE
    size = np.sqrt(np.maximum(np.diag(known), 1e-300))
    inverse = np.linalg.pinv(known / np.outer(size, size), hermitian=True) / np.outer(size, size)
    return np.asarray(gram - gram[:, beside] @ inverse @ gram[beside])
