"""Curves without a name that a flexible effect comes near.

A wave of one period over the travelled range, beside a straight line, follows almost any smooth
curve of the angle: a stiffness that grows gives one. So an effect may say what curve it must beat
(`Effect.curve`): in place of it, and of all other effects of its joint that are functions of the
same quantity, the curve is fitted. Where that leaves no more, the form of the effect is not shown.
Some (`Effect.holds_until_beaten`) are doubted only where it leaves less on their joints, by a share
of what they leave that they state, beyond chance.
"""

from collections.abc import Sequence

from scipy.stats import chi2

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.tracing import Traced
from excite_cli.diagnosis.training import Columns, Shown

_SURE = 1e-3  # chance that a curve as good as the effect leaves so much more, or less


def curves_in_place(traced: Traced, joint_names: Sequence[str]) -> dict[int, Covariate]:
    """Chosen candidates in whose place a curve without a name does, and of what it is one."""
    found: dict[int, Covariate] = {}
    for i in traced.chosen:
        own = traced.candidates[i]
        parts = [own.effect.curve(signals, traced.signals) for signals in traced.signals]
        if i in found or not parts or any(part is None for part in parts):
            continue
        like = functions_alike(traced, i)
        of = Covariate(own.effect.function_of[0], joint_names[own.effect.joints[0]])
        columns = tuple(
            run.averaged_for_fit(part, own.rows)
            for run, part in zip(traced.data.runs, parts, strict=True)
            if part is not None
        )
        if _does_as_well(traced, like, Shown(own.rows, columns)):
            found |= dict.fromkeys(like, of)
    return found


def functions_alike(traced: Traced, i: int) -> list[int]:
    """Chosen candidates of the same joints that are functions of the same quantity, i with them."""
    own = traced.candidates[i]
    return [
        k
        for k in traced.chosen
        if traced.candidates[k].rows == own.rows
        and traced.candidates[k].effect.function_of == own.effect.function_of
    ]


def _does_as_well(traced: Traced, like: Sequence[int], curve: Shown) -> bool:
    pool: list[Columns] = [*(traced.candidates[i] for i in traced.chosen), curve]
    white = traced.data.evidence(pool, traced.noise)
    every = range(len(traced.chosen))
    others = [k for k in every if traced.chosen[k] not in like]
    with_effects = white.energy(every)
    more = white.energy([*others, len(traced.chosen)]) - with_effects
    beaten = min(traced.candidates[i].effect.holds_until_beaten for i in like)
    if not beaten:
        return bool(more < traced.inflation * chi2.isf(_SURE, 1))
    chance = traced.inflation * chi2.isf(_SURE, curve.width)
    left = white.energy_on(every, traced.candidates[like[0]].rows)
    return bool(-more > max(chance, beaten * left))
