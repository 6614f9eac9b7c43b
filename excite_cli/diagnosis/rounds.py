"""The way from the declared model to the diagnosis, one effect at a time."""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.records import Round, Suspect, by_joint
from excite_cli.diagnosis.search_loop import SearchResult
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.words import joints_in_words
from excite_cli.robot.model import Array

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
        if verdict is Verdict.IMPOSSIBLE_SIGN:
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
