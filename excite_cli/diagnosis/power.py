"""Which effects motions would show: before anything is measured.

A diagnosis tries an effect beside the base parameters, the declared effects, and the friction,
offsets and rotors of a textbook on all joints. With G = CᵀC of the recordings (`prediction.py`), k
these columns and p that of the effect, its size z (in units of its prior deviation) is known with

    s⁻² = G_pp − G_pk (G_kk + P)⁻¹ G_kp.

P is of effects alone: inertias take all that they can explain. A diagnosis names it
where it saves more χ² than its price c (`price`). With the true size z that χ² is noncentral, so
that it is named with the power

    P(χ²₁(z²/s²) > c) = Φ(z/s − √c) + Φ(−z/s − √c),

and the size that is named with 95 % is about s (√c + 1.645). What a diagnosis holds out is no part
of the motions. Nor does it name what is too small to need one (`rules.SMALLEST`), however surely it
is there.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, norm

from excite_cli.diagnosis import rules
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, catalogue
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.prediction import Prediction

SURE = 0.95
# χ² of columns that are shifted in time exceeds that of chance by this factor: the median of the
# placebos of real logs.
_INFLATION = 1.5
TEXTBOOK = (*EVERYDAY_FRICTION, *EVERYDAY)
RIDGE = 1e-9  # of what is known of every column
# Share of an effect's energy below which the base parameters say it all: rounding.
_NOTHING = 1e-6
_ROUNDING = 1e-9


@dataclass(frozen=True)
class EffectPower:
    """The `size` of an effect's first parameter, in `unit`, that is named with this `power`.

    `share`: that size as a share of the joint's usual torque, by the effect's RMS torque; `times`:
    that size over the standard deviation with which the motions show it.
    """

    kind: str
    joints: tuple[str, ...]
    parameter: str
    size: float
    unit: str
    share: float
    power: float
    times: float


def price(kind: type[Effect], significance: float) -> float:
    """χ² that an effect with one parameter must save to be named."""
    tests = len(catalogue())
    return _INFLATION * float(chi2.isf(significance / tests, 1)) + kind.prior_cost


def sizes_shown(
    prediction: Prediction, stack: Stack, significance: float, power: float = SURE
) -> tuple[EffectPower, ...]:
    """For every effect that the robot may have, the size that the motions in `stack` would show.

    Those that are declared are in the model whatever their size.
    """
    return tuple(
        _shown(prediction, at, deviation, significance, power)
        for at, deviation in enumerate(_deviations(prediction, stack))
        if at >= prediction.declared
    )


def power_of(
    prediction: Prediction, stack: Stack, significance: float, kind: str, size: float
) -> tuple[EffectPower, ...]:
    """How probably the motions would show effects of `kind` with `size`, on every joint."""
    found = []
    for at, deviation in enumerate(_deviations(prediction, stack)):
        effect, scale, share = _about(prediction, at)
        if effect.kind == kind:
            times = size / scale / deviation
            chance = probability_named(times, price(type(effect), significance))
            if share * size / scale < (1.0 - _ROUNDING) * rules.SMALLEST:
                chance = 0.0
            found.append(_record(prediction, effect, size, share * size / scale, chance, times))
    return tuple(found)


def least_sizes(prediction: Prediction, kind: str) -> tuple[EffectPower, ...]:
    """On every joint the size of `kind` below which no motions make a diagnosis name it."""
    found = []
    for at in range(len(prediction.extension.effects)):
        effect, scale, share = _about(prediction, at)
        if effect.kind == kind:
            size = rules.SMALLEST / share * scale
            found.append(_record(prediction, effect, size, rules.SMALLEST, 1.0, np.inf))
    return tuple(found)


def _deviations(prediction: Prediction, stack: Stack) -> np.ndarray:
    """s of the first parameter of every effect, infinite where the motions say nothing of it."""
    extension, rank = prediction.extension, prediction.rank
    kept = np.arange(rank)
    for at, (effect, own) in enumerate(
        zip(extension.effects, extension.columns().slices, strict=True)
    ):
        if at < prediction.declared or effect.kind in TEXTBOOK:
            kept = np.append(kept, rank + np.arange(own.start, own.stop))
    gram = stack.factor.T @ stack.factor
    known = gram + np.diag(np.where(np.arange(len(gram)) < rank, 0.0, 1.0))
    known[np.diag_indices(rank)] *= 1.0 + RIDGE
    beside = known[np.ix_(kept, kept)]
    size = np.sqrt(np.maximum(np.diag(beside), 1e-300))
    inverse = np.linalg.pinv(beside / np.outer(size, size), hermitian=True) / np.outer(size, size)
    variances = dict(zip(kept.tolist(), np.diag(inverse).tolist(), strict=True))
    found = []
    for p in prediction.first_columns.tolist():
        own = gram[p, p]
        across = gram[kept, p]
        informed = 1.0 / variances[p] - 1.0 if p in variances else own - across @ inverse @ across
        found.append(informed**-0.5 if informed > _NOTHING * own else np.inf)
    return np.array(found)


def _shown(
    prediction: Prediction, at: int, deviation: float, significance: float, power: float
) -> EffectPower:
    effect, scale, share = _about(prediction, at)
    cost = price(type(effect), significance)
    size = times_named(cost, power) * deviation if np.isfinite(deviation) else float("inf")
    size = max(size, rules.SMALLEST / share)
    times = size / deviation if np.isfinite(deviation) else 0.0
    return _record(prediction, effect, size * scale, size * share, power, times)


def times_named(cost: float, power: float) -> float:
    """Size, in standard deviations, that is named with this power at the price `cost` [χ²]."""
    low, high = 0.0, np.sqrt(cost) - norm.ppf(min(1.0 - power, 0.5)) + 1.0
    return float(brentq(lambda times: probability_named(times, cost) - power, low, high))


def probability_named(times: float, cost: float) -> float:
    """Φ(x − √c) + Φ(−x − √c)."""
    least = np.sqrt(cost)
    return float(norm.sf(least - times) + norm.sf(least + times))


def _about(prediction: Prediction, at: int) -> tuple[Effect, float, float]:
    """An effect, the prior deviation of its first parameter, and the share of torque that makes."""
    effect = prediction.extension.effects[at]
    column = int(prediction.first_columns[at]) - prediction.rank
    return effect, float(prediction.extension.scales[column]), float(prediction.shares[column])


def _record(
    prediction: Prediction, effect: Effect, size: float, share: float, power: float, times: float
) -> EffectPower:
    robot, first = prediction.extension.robot, effect.parameters[0]
    joints = tuple(robot.joint_names[j] for j in effect.joints)
    unit = effect.unit_on(first.unit, robot.sliding)
    return EffectPower(effect.kind, joints, first.name, size, unit, share, power, times)
