"""What was traced, as named effects: sizes, evidence, and what may stand for them.

And what the training data say of all these, for the next motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky

from excite_cli.diagnosis.aliases import aliases_of
from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.final_fit import FinalFit
from excite_cli.diagnosis.held_out_verdict import Worth
from excite_cli.diagnosis.misspecification import explained
from excite_cli.diagnosis.modelled_run import places_of
from excite_cli.diagnosis.records import (
    Approximation,
    EffectRecord,
    Information,
    NamedEffect,
    by_joint,
)
from excite_cli.diagnosis.schur import SHARED
from excite_cli.diagnosis.search_loop import SearchResult
from excite_cli.effects.place import Place
from excite_cli.effects.placing import told_on
from excite_cli.robot.model import Array

Rival = tuple[int, EffectRecord]  # a candidate that may stand for an effect, with values


def named_effects(
    traced: SearchResult,
    final: FinalFit,
    doubts: Mapping[int, Approximation],
    worth: Mapping[int, Worth],
    taken_off: Mapping[int, Array],
    links: Sequence[str],
) -> tuple[dict[int, NamedEffect], list[Rival]]:
    """Named effects by candidate, the strongest first; and their aliases.

    Sizes are the coefficients of the model that predicts: summed up, they are its torque.
    `taken_off`: what each takes off the joints' errors.
    """
    judge, robot = traced.judge, traced.model.robot
    found: dict[int, NamedEffect] = {}
    strength: dict[int, float] = {}
    rivals: list[Rival] = []
    places = places_of(traced.effects, len(final.parameters))
    for i, effect, own in zip(traced.chosen, traced.effects, places, strict=True):
        rest = judge.without(i, traced.chosen)
        gain = judge.white.schur(rest).gain(i, absorbed=SHARED)
        strength[i] = gain.chi2
        joints = list(traced.candidates[i].rows)
        share = explained(traced, i, rest, joints) / max(judge.plain.energy_on((), joints), 1e-300)
        aliases = _aliases(traced, i, rest) if i not in doubts else []
        rivals += aliases
        values, link = final.parameters[own], told_on(effect, robot, links)
        seen = effect.seen_from(link) if link else np.eye(len(values))
        record = record_of(effect, robot.joint_names, values)
        found[i] = NamedEffect(
            effect=replace(record, link=link.name if link else ""),
            parameters=effect.report_on(
                robot.sliding, seen @ values, seen @ final.covariance[own, own] @ seen.T
            ),
            p_value=judge.reported_p_value(i, gain),
            share_of_residual=float(np.clip(share, 0.0, 1.0)),
            gain=float(judge.left_out_gain(rest, [i])),
            aliases=tuple(record for _, record in aliases),
            approximates=doubts.get(i),
            least_p=judge.rules.least_p,
            verdict=worth[i].verdict,
            removes=worth[i].removes,
            parts=by_joint(robot.joint_names, taken_off[i]),
        )
    order = sorted(found, key=lambda i: -strength[i])
    return {i: found[i] for i in order}, rivals


def _aliases(traced: SearchResult, i: int, rest: Sequence[int]) -> list[Rival]:
    """What may stand for chosen candidate i beside the rest, with the values that it has then."""
    judge, model = traced.judge, traced.model

    def possible(others: Sequence[int], d: int) -> bool:
        together = [*others, d]
        return judge.allowed(judge.plain.solve(together), together, [d])

    taken = {effect.place for effect in (*model.declared, *traced.effects)}
    found = aliases_of(i, rest, taken, traced.candidates, judge.white, traced.inflation, possible)
    rivals = []
    for k in (alias.candidate for alias in found):
        own = traced.candidates[k]
        values = judge.plain.solve([*rest, k])[-own.width :]
        rivals.append((k, record_of(own.effect, model.robot.joint_names, values)))
    return rivals


def information_of(traced: SearchResult, rivals: Sequence[Rival]) -> Information:
    """Triangular factor of the training data's columns, whitened, for the next motion."""
    model, effects = traced.model, (*traced.model.declared, *traced.effects)
    unique: dict[Place, Rival] = {}
    for i, record in rivals:
        unique.setdefault(traced.candidates[i].place, (i, record))
    data = replace(traced.data, prior=None, weighed=None)
    pool = [traced.candidates[i] for i in (*traced.chosen, *(i for i, _ in unique.values()))]
    gram = data.evidence(pool, traced.noise).grams.total()[:-1, :-1]
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit = gram / np.outer(scale, scale)
    unit[np.diag_indices(len(unit))] += 1e-12
    parameters = traced.judge.plain.solve(traced.chosen)
    return Information(
        factor=cholesky(unit) * scale,
        rank=model.base.rank,
        model=tuple(
            record_of(effect, model.robot.joint_names, parameters[own])
            for effect, own in zip(effects, places_of(effects, len(parameters)), strict=True)
        ),
        rivals=tuple(record for _, record in unique.values()),
        noise=traced.levels,
    )
