"""Viscous and Coulomb friction as data sheets give it: a straight line through all friction.

Beside friction that is curved over speed, or grows with load, the model's own viscous and Coulomb
terms are what that leaves: they may be anything, and nobody knows them by these numbers. What data
sheets and other fits call f_v and f_c is the line

    f_v v + f_c sgn v   nearest to   Σ_e C_e θ_e   (friction of the joint, over the training data),

linear in θ, so its standard deviations follow from the covariance of θ.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.before_after import Played
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.records import FrictionLine
from excite_cli.diagnosis.sealed_verdict import worth_of_friction
from excite_cli.diagnosis.tracing import Traced
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import straight_friction
from excite_cli.effects.parameter import Value, deviation
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.regression import effect_columns
from excite_cli.robot.model import Array

_ROUNDING = 1e-9  # of a line of friction that has no such part


def data_sheet_lines(
    model: Model, traced: Traced, parameters: Array, covariance: Array
) -> tuple[FrictionLine, ...]:
    """The line of every joint that has friction, in the robot's order.

    `parameters` (k,) and their `covariance` end with those of the declared effects and of those
    that were found.
    """
    lines = (_line(j, model, traced, parameters, covariance) for j in range(model.robot.n))
    return tuple(line for line in lines if line is not None)


def with_worth(
    lines: Sequence[FrictionLine],
    held: Played,
    traced: Traced,
    after: IdentifiedModel,
    taken_off: Mapping[int, Array],
) -> tuple[FrictionLine, ...]:
    """The lines with what all friction of each joint is worth on held-out data.

    `taken_off`: what each effect takes off the joints' errors.
    """
    names, found = traced.model.robot.joint_names, []
    for line in lines:
        own, worth = worth_of_friction(held, traced.model, traced, after, names.index(line.joint))
        told = replace(line, kinds=tuple(traced.candidates[i].effect.kind for i in own))
        if worth is not None:
            parts = np.sum([taken_off[i] for i in own], axis=0)
            told = replace(
                told,
                verdict=worth.verdict,
                removes=worth.removes,
                parts=dict(zip(names, map(float, parts), strict=True)),
            )
        found.append(told)
    return tuple(found)


def _line(
    joint: int, model: Model, traced: Traced, parameters: Array, covariance: Array
) -> FrictionLine | None:
    effects = (*model.declared, *traced.effects)
    at = len(parameters) - sum(len(each.parameters) for each in effects)
    own: list[int] = []
    kinds: list[Effect] = []
    for effect in effects:
        width = len(effect.parameters)
        if effect.friction and effect.joints == (joint,):
            own += range(at, at + width)
            kinds.append(effect)
        at += width
    if not kinds:
        return None
    straight = straight_friction(joint)
    lines, friction = [], []
    for run, signals in zip(traced.data.runs, traced.signals, strict=True):
        columns = run.averaged_for_fit(
            effect_columns([*straight, *kinds], signals)[:, [joint]], [joint]
        )[run.usable[:, joint], 0]
        lines.append(columns[:, : len(straight)])
        friction.append(columns[:, len(straight) :])
    slopes = np.linalg.lstsq(np.concatenate(lines), np.concatenate(friction), rcond=1e-9)[0]
    slopes[np.abs(slopes) < _ROUNDING] = 0.0
    spread = covariance[np.ix_(own, own)]
    units = [each.unit_on(each.parameters[0].unit, model.robot.sliding) for each in straight]
    f_v, f_c = (
        Value(float(slope @ parameters[own]), deviation(slope, spread), unit)
        for slope, unit in zip(slopes, units, strict=True)
    )
    places = {each.place for each in straight}
    curved = any(effect.place not in places for effect in kinds)
    return FrictionLine(model.robot.joint_names[joint], f_v, f_c, curved)
