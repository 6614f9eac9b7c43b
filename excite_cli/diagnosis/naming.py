"""What was traced, as named effects: sizes, evidence, and what may stand for them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.aliases import Alias, aliases_of
from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.records import Approximation, NamedEffect
from excite_cli.diagnosis.schur import SHARED
from excite_cli.diagnosis.sealed_verdict import Worth
from excite_cli.diagnosis.tracing import Traced
from excite_cli.effects.placing import told_on
from excite_cli.robot.model import Array

Rival = tuple[Alias, Array]  # what may stand for an effect, and the values that it has then


def named_effects(
    model: Model,
    traced: Traced,
    fitted: tuple[Array, Array],
    doubts: Mapping[int, Approximation],
    worth: Mapping[int, Worth],
    taken_off: Mapping[int, Array],
    links: Sequence[str],
) -> tuple[tuple[NamedEffect, ...], tuple[int, ...], list[Rival]]:
    """Named effects, the strongest first; their candidates; aliases with their own values.

    Sizes are the coefficients of the model that predicts: summed up, they are its torque. `fitted`:
    all parameters and their covariance; `taken_off`: what each takes off the joints' errors.
    """
    (parameters, covariance), judge, names = fitted, traced.judge, model.robot.joint_names
    start = len(parameters) - sum(traced.candidates[i].width for i in traced.chosen)
    found: list[NamedEffect] = []
    strength: list[float] = []
    taken = {effect.place for effect in (*model.declared, *traced.effects)}
    rivals: list[Rival] = []
    at = start
    for i in traced.chosen:
        c = traced.candidates[i]
        own = slice(at, at + c.width)
        at += c.width
        rest = judge.without(i, traced.chosen)
        gain = judge.white.schur(rest).gain(i, absorbed=SHARED)
        joints = list(c.rows)
        whole = judge.plain.energy_on((), joints)
        share = (
            judge.plain.energy_on(rest, joints) - judge.plain.energy_on([*rest, i], joints)
        ) / max(whole, 1e-300)

        def possible(others: Sequence[int], d: int) -> bool:
            together = [*others, d]
            return judge.allowed(judge.plain.solve(together), together, [d])

        aliases = []
        if i not in doubts:
            aliases = aliases_of(
                i, rest, taken, traced.candidates, judge.white, traced.inflation, possible
            )
        records = []
        for alias in aliases:
            values = judge.plain.solve([*rest, alias.candidate])
            width = traced.candidates[alias.candidate].width
            rivals.append((alias, values[-width:]))
            records.append(
                record_of(traced.candidates[alias.candidate].effect, names, values[-width:])
            )
        strength.append(gain.chi2)
        link = told_on(c.effect, model.robot, links)
        seen = c.effect.seen_from(link) if link else np.eye(c.width)
        found.append(
            NamedEffect(
                effect=replace(
                    record_of(c.effect, names, parameters[own]), link=link.name if link else ""
                ),
                parameters=c.effect.report_on(
                    model.robot.sliding,
                    seen @ parameters[own],
                    seen @ covariance[own, own] @ seen.T,
                ),
                p_value=judge.told_p_value(i, gain),
                share_of_residual=float(np.clip(share, 0.0, 1.0)),
                gain=float(judge.left_out_gain(rest, [i])),
                aliases=tuple(records),
                approximates=doubts.get(i),
                least_p=judge.rules.least_p,
                verdict=worth[i].verdict,
                removes=worth[i].removes,
                parts=dict(zip(names, map(float, taken_off[i]), strict=True)),
            )
        )
    order = np.argsort([-each for each in strength], kind="stable")
    return tuple(found[k] for k in order), tuple(traced.chosen[k] for k in order), rivals
