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

from excite_cli.diagnosis.final_fit import FinalFit
from excite_cli.diagnosis.held_out_errors import HeldOutRuns
from excite_cli.diagnosis.held_out_verdict import worth_beside
from excite_cli.diagnosis.records import FrictionLine, by_joint
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.effects.catalogue import straight_friction
from excite_cli.effects.parameter import Value, deviation
from excite_cli.identification.identified_model import Prediction
from excite_cli.identification.regression import effect_columns, places_of
from excite_cli.robot.model import Array

_ROUNDING = 1e-9  # of a line of friction that has no such part


def data_sheet_lines(traced: SearchResult, final: FinalFit) -> tuple[FrictionLine, ...]:
    """The line of every joint that has friction, in the robot's order."""
    lines = (_line(joint, traced, final) for joint in range(traced.model.robot.n))
    return tuple(line for line in lines if line is not None)


def with_worth(
    lines: Sequence[FrictionLine],
    held: HeldOutRuns,
    traced: SearchResult,
    with_all: Sequence[Prediction],
    taken_off: Mapping[int, Array],
) -> tuple[FrictionLine, ...]:
    """The lines with what all friction of each joint alone is worth on held-out data.

    `with_all`: what the whole model predicts there; `taken_off`: what each effect takes off the
    joints' errors.
    """
    names, found = traced.model.robot.joint_names, []
    for line in lines:
        joint = names.index(line.joint)
        own = {
            i: effect.kind
            for i, effect in zip(traced.chosen, traced.effects, strict=True)
            if effect.friction and effect.joints == (joint,)
            if not (effect.runs or effect.is_change)
        }
        line = replace(line, kinds=tuple(own.values()))
        if len(own) > 1:  # the worth of one is known
            rest = [i for i in traced.chosen if i not in own]
            worth = worth_beside(held, traced, with_all, rest, (joint,))
            parts = by_joint(names, np.sum([taken_off[i] for i in own], axis=0))
            line = replace(line, verdict=worth.verdict, removes=worth.removes, parts=parts)
        found.append(line)
    return tuple(found)


def _line(joint: int, traced: SearchResult, final: FinalFit) -> FrictionLine | None:
    robot, effects = traced.model.robot, (*traced.model.declared, *traced.effects)
    places = places_of(effects, len(final.parameters))
    rubbing = [
        (effect, own)
        for effect, own in zip(effects, places, strict=True)
        if effect.friction and effect.joints == (joint,)
    ]
    if not rubbing:
        return None
    kinds = [effect for effect, _ in rubbing]
    straight = straight_friction(joint)
    columns = []
    for run, signals in zip(traced.data.runs, traced.signals, strict=True):
        raw = effect_columns([*straight, *kinds], signals)[:, [joint]]
        columns.append(run.averaged_for_fit(raw, [joint])[run.usable[:, joint], 0])
    lines, friction = np.split(np.concatenate(columns), [len(straight)], axis=1)
    slopes = np.linalg.lstsq(lines, friction, rcond=1e-9)[0]
    slopes[np.abs(slopes) < _ROUNDING] = 0.0
    own = np.r_[tuple(own for _, own in rubbing)]
    values, spread = final.parameters[own], final.covariance[np.ix_(own, own)]
    viscous, coulomb = (
        Value(
            float(slope @ values),
            deviation(slope, spread),
            each.unit_on(each.parameters[0].unit, robot.sliding),
        )
        for slope, each in zip(slopes, straight, strict=True)
    )
    plain = {each.place for each in straight}
    curved = any(effect.place not in plain for effect in kinds)
    fastest = max(float(np.abs(each.v[:, joint]).max(initial=0.0)) for each in traced.signals)
    return FrictionLine(robot.joint_names[joint], viscous, coulomb, curved, fastest=fastest)
