"""What was traced, as named effects: sizes, evidence, and what may stand for them.

And what the training data say of all these, for the next motion.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky

from excite_cli.diagnosis.aliases import aliases_of
from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.final_fit import FinalFit
from excite_cli.diagnosis.held_out_verdict import Worth
from excite_cli.diagnosis.misspecification import explained
from excite_cli.diagnosis.records import (
    Approximation,
    EffectRecord,
    Information,
    NamedEffect,
    Round,
    Suspect,
    by_joint,
)
from excite_cli.diagnosis.schur import SHARED
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.words import joints_in_words
from excite_cli.effects.base import Place
from excite_cli.effects.placing import told_on
from excite_cli.excitation.prediction import may_be_planned_for
from excite_cli.identification.regression import places_of
from excite_cli.robot.model import Array

# The way from the declared model to the diagnosis, one effect at a time.

_SUSPECTS = 5


def rounds_of(traced: SearchResult) -> tuple[Round, ...]:
    """Rounds in the order of what each effect saves; the last one finds nothing more."""
    names, order = traced.model.robot.joint_names, order_of(traced)
    found: list[Round] = []
    for count, best in enumerate([*order, None]):
        residual = by_joint(names, _residual(traced, order[:count]))
        suspects = _suspects(traced, order[:count], best)
        verdict = "nothing more" if best is None else _words(traced, best)
        found.append(Round(count + 1, residual, suspects, verdict))
    return tuple(found)


def order_of(traced: SearchResult) -> list[int]:
    """The chosen candidates, first what saves most, then what saves most beside it, and so on."""
    order: list[int] = []
    judge, left = traced.judge, set(traced.chosen)
    while left:
        singles = judge.white.schur(order).singles
        order.append(max(left, key=lambda i: singles[i].chi2 - judge.price(i, 1)))
        left.remove(order[-1])
    return order


def _words(traced: SearchResult, i: int) -> str:
    effect, joint_names = traced.candidates[i].effect, traced.model.robot.joint_names
    where = joints_in_words([joint_names[j] for j in effect.joints], len(joint_names))
    return f"{effect.kind} on {where}" + (f", by {effect.covariate}" if effect.covariate else "")


def _residual(traced: SearchResult, chosen: Sequence[int]) -> Array:
    """RMS (n,) [N·m] of what the model with the chosen effects leaves of the training torque."""
    x = traced.judge.plain.solve(chosen)
    left = traced.data.residuals(traced.candidates, chosen, x)
    usable = np.concatenate([run.usable for run in traced.data.runs])
    squares = np.where(usable, np.concatenate(left) ** 2, 0.0).sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(usable.sum(axis=0), 1)))


def _suspects(traced: SearchResult, chosen: list[int], accepted: int | None) -> tuple[Suspect, ...]:
    """The strongest candidates of a round, one per kind and place, the accepted one first."""
    judge, joint_names = traced.judge, traced.model.robot.joint_names
    schur = judge.white.schur(chosen)
    taken = {traced.candidates[i].place for i in chosen}
    ranked = sorted(
        (i for i, c in enumerate(traced.candidates) if c.place not in taken),
        key=lambda i: judge.price(i, schur.singles[i].dof) - schur.singles[i].chi2,
    )
    order = ([accepted] if accepted is not None else []) + [i for i in ranked if i != accepted]
    found: list[Suspect] = []
    places: set = set()
    for i in order:
        candidate = traced.candidates[i]
        if candidate.place in places:
            continue
        places.add(candidate.place)
        p, joints = judge.p_value(i, schur.singles[i]), list(candidate.rows)
        before = judge.plain.energy_on(chosen, joints)
        share = 1.0 - judge.plain.energy_on([*chosen, i], joints) / max(before, 1e-300)
        if i == accepted:
            verdict = Verdict.ACCEPTED
        elif p > judge.rules.significance:
            verdict = Verdict.NOT_SIGNIFICANT
        else:
            verdict = judge.verdict(chosen, [i])
            if verdict is Verdict.ACCEPTED:
                verdict = Verdict.LATER if i in traced.chosen else Verdict.EXPLAINED
        why = ""
        if verdict is Verdict.IMPLAUSIBLE_SIZE:
            together = [*chosen, i]
            why = traced.sizes.why_not(judge.plain.solve(together), together, [i])
        found.append(
            Suspect(
                record_of(candidate.effect, joint_names),
                max(p, judge.rules.least_p),
                share,
                judge.left_out_gain(chosen, [i]),
                verdict,
                judge.rules.least_p,
                why,
            )
        )
        if len(found) == _SUSPECTS:
            break
    return tuple(found)


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
            p_value=max(judge.p_value(i, gain), judge.rules.least_p),  # which the placebos back
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
    rival = [i for i, _ in unique.values()]
    possible = _possible(traced, {*(effect.place for effect in effects), *unique})
    pool = [traced.candidates[i] for i in (*traced.chosen, *rival, *possible)]
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
        possible=tuple(
            record_of(each.effect, model.robot.joint_names, np.zeros(each.width))
            for each in (traced.candidates[i] for i in possible)
        ),
    )


def _possible(traced: SearchResult, there: Collection[Place]) -> list[int]:
    """Of every kind that many robots have the first candidate at every place that is not `there`.

    Those of the next motion that are planned for beside what was found; none where a wrench at the
    base is measured, since it is planned for the inertias alone.
    """
    if traced.model.robot.base_joints:
        return []
    found: dict[Place, int] = {}
    for i, each in enumerate(traced.candidates):
        if may_be_planned_for(type(each.effect), traced.model.robot) and not each.effect.runs:
            found.setdefault(each.place, i)
    return [i for place, i in found.items() if place not in there]
