"""Names that do not hold: effects that only approximate something outside the catalogue.

A line through a curve explains most of it, not its form. So for each effect that was found, E is
the energy it explains on the joint where it matters most, and U what is surely left there beside
the noise (`rests`): what can be predicted or, if that is more, what exceeds the noise; or what an
effect of an impossible sign or size would explain. The effect is an approximation

* if what is left is a function of the effect's own quantity alone (friction: speed), and what is
  predicted of it is more than 0.1 E; if it is one of two, and U > 0.5 E,
* or if U > E, whatever it depends on, unless inertias nearly take the effect up,
* or if a curve without a name does as well (`curves`), or more than noise is left for sure of a
  form that was not seen to repeat (a wave of less than three periods),
* or if it is a change in some runs that explains less than is left in these, noise included,
* or if it is the mean of a curve that is one (`_means_of_curves`).

Rests say nothing of effects that inertias nearly take up, of which E is next to nothing, but by
their own quantity. A change in some runs or over time, first-order friction and, where a good part
can be predicted, a constant are means of a function of anything: U > 0.25 E is enough for changes,
U > 0.3 E for friction and U > 0.5 E for constants (docs/decisions/names-beside-large-residuals.md).
"""

from collections.abc import Mapping, Sequence
from functools import cache, partial

import numpy as np
from scipy.stats import chi2

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Approximation, ExcessResidual
from excite_cli.diagnosis.schur import SHARED
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.training import Columns, PartColumns
from excite_cli.effects.base import Effect, Tier

# Curves without a name that a flexible effect comes near.
#
# A wave of one period over the travelled range, beside a straight line, follows almost any smooth
# curve of the angle: a stiffness that grows gives one. So an effect may say what curve it must beat
# (`Effect.curve`): in place of it, and of all other effects of its joint that are functions of the
# same quantity, the curve is fitted. Where that leaves no more, the form of the effect is not
# shown. Some (`Effect.holds_until_beaten`) are doubted only where it leaves less on their joints,
# by a share of what they leave that they state, beyond chance.

_SURE = 1e-3  # chance that a curve as good as the effect leaves so much more, or less


def curves_in_place(traced: SearchResult, joint_names: Sequence[str]) -> dict[int, Covariate]:
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
        if _does_as_well(traced, like, PartColumns(own.rows, columns)):
            found |= dict.fromkeys(like, of)
    return found


def functions_alike(traced: SearchResult, i: int) -> list[int]:
    """Chosen candidates of the same joints that are functions of the same quantity, i with them."""
    own = traced.candidates[i]
    return [
        k
        for k in traced.chosen
        if traced.candidates[k].rows == own.rows
        and traced.candidates[k].effect.function_of == own.effect.function_of
    ]


def _does_as_well(traced: SearchResult, like: Sequence[int], curve: PartColumns) -> bool:
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


_SAME_QUANTITY, _ONE_OF_TWO = 0.1, 0.5
_OF_FRICTION, _OF_CHANGE = 0.3, 0.25
# 0.6 of friction in one sector, taken for Coulomb friction that varies; at most 0.03 of real ones.
_OF_VARIED = 0.3
_PREDICTABLE = 0.3  # share: less may be all that exceeds the noise, or not
# Of an effect's columns: 0.03 and 0.23 of what a data sheet vouches for, 0.9 of wrong names.
_OF_ITS_OWN = 0.5
_TRIED = 12  # of the strongest candidates of a joint


def approximations(
    traced: SearchResult,
    joint_names: Sequence[str],
    rests: Sequence[ExcessResidual],
) -> dict[int, Approximation]:
    """Which chosen candidates are approximations, and of what."""
    more = {each.joint: each for each in rests if each.certain}
    found = {
        i: Approximation(covariates=(of,)) for i, of in curves_in_place(traced, joint_names).items()
    }
    for i in (each for each in traced.chosen if _may_not_repeat(traced, each)):
        rest = more.get(joint_names[traced.candidates[i].effect.joints[0]])
        if rest is not None:
            doubt = Approximation(covariates=rest.depends_on)
            found |= dict.fromkeys(functions_alike(traced, i), doubt)
    impossible = cache(partial(_impossible, traced))
    for i in (each for each in traced.chosen if each not in found):
        if traced.judge.identified_by_prior_only(i, traced.judge.without(i, traced.chosen)):
            continue  # inertias could explain it all: how much it explains says nothing
        joint, energy = _strongest(traced, i)
        name = joint_names[joint]
        if _weaker_than_its_runs(traced, i, joint, energy):
            found[i] = Approximation()
            continue
        whole = traced.judge.plain.energy_on(traced.chosen, [joint])
        if name in more and _is_outdone(traced, i, more[name], energy / whole, joint_names):
            found[i] = Approximation(covariates=more[name].depends_on)
            continue
        most, what = impossible(joint, traced.candidates[i].effect.function_of)
        if most > energy:
            found[i] = Approximation(kind=what)
    return found | _means_of_curves(traced, found)


def _is_outdone(
    traced: SearchResult, i: int, rest: ExcessResidual, explained: float, joint_names: Sequence[str]
) -> bool:
    """Whether what is left says more than candidate i, whose E is given in units of the rest."""
    same = _same_quantity(traced, i, rest.depends_on, joint_names)
    if same and len(rest.depends_on) == 1 and rest.predictable > _SAME_QUANTITY * explained:
        return True
    if not _of_its_own(traced, i, rest):
        return False
    limit = _limit_of_mean(traced, i, rest) or (_ONE_OF_TWO if same else 1.0)
    return _surely_left(rest) > limit * explained


def _weaker_than_its_runs(traced: SearchResult, i: int, joint: int, explained: float) -> bool:
    """Whether a change explains less than what is left in its runs, noise included.

    Noise that differs from run to run, as a load makes it, is judged by one deviation.
    """
    own = traced.candidates[i]
    if not own.effect.is_change:
        return False
    folds, others = set[int](), set[int]()
    for fold, part in zip(traced.data.folds, own.columns, strict=True):
        (folds if np.any(part) else others).add(fold)
    if folds & others:  # of many runs several are one fold, and what is left is known by fold
        return False
    left = traced.judge.plain.in_turn.energies(traced.chosen, [joint]).reshape(-1, 2).sum(axis=1)
    return bool(left[sorted(folds)].sum() > explained)


def _may_not_repeat(traced: SearchResult, i: int) -> bool:
    """Whether it is on one joint, and its form is a curve's as far as one sees."""
    effect = traced.candidates[i].effect
    if effect.holds_until_beaten or len(effect.joints) != 1:
        return False
    return any(effect.curve(each, traced.signals) is not None for each in traced.signals[:1])


def _means_of_curves(
    traced: SearchResult, found: Mapping[int, Approximation]
) -> dict[int, Approximation]:
    """What is the mean of an approximation: a constant, or the friction that it varies.

    A constant of a joint where a function of its angle explains more than it; friction of which
    what varies it explains a good part.
    """
    means = {}
    for i in (each for each in traced.chosen if each not in found):
        effect, rows = traced.candidates[i].effect, traced.candidates[i].rows
        for k, approximation in found.items():
            own = traced.candidates[k].effect
            if traced.candidates[k].rows != rows:
                continue
            if _is_constant(effect) and not effect.runs and own.function_of == ("position",):
                least = 1.0
            elif effect.kind == own.varied and not effect.runs:
                least = _OF_VARIED
            else:
                continue
            if _strongest(traced, k)[1] > least * _strongest(traced, i)[1]:
                means[i] = approximation
    return means


def _of_its_own(traced: SearchResult, i: int, rest: ExcessResidual) -> bool:
    """Whether E says how much candidate i explains: the rest of the model takes little of it up.

    What inertias nearly take up has next to no E, however large it is.
    """
    effect = traced.candidates[i].effect
    if _is_constant(effect) and not (effect.refines or effect.runs):
        return rest.predictable > _PREDICTABLE  # else it is the mean of nothing
    return not _taken_up(traced, i)


def _taken_up(traced: SearchResult, i: int) -> bool:
    """Whether the rest of the model nearly takes candidate i up; not what lacks a name mostly."""
    effect, judge = traced.candidates[i].effect, traced.judge
    if effect.refines or effect.runs or _is_constant(effect):
        return False
    others = judge.without(i, traced.chosen)
    return bool(judge.white.schur(others).gain(i, absorbed=SHARED).left <= _OF_ITS_OWN)


def _limit_of_mean(traced: SearchResult, i: int, rest: ExcessResidual) -> float | None:
    """U/E from which it is the mean of something; None if it would not be that of any function."""
    effect = traced.candidates[i].effect
    if effect.is_change or "time" in effect.function_of:
        return _OF_CHANGE
    if _is_constant(effect):
        return _ONE_OF_TWO if rest.predictable > _PREDICTABLE else None
    return _OF_FRICTION if effect.tier == Tier.EVERY_ROBOT else None


def _is_constant(effect: Effect) -> bool:
    return not effect.function_of and len(effect.joints) == 1 and not effect.carried


def _surely_left(rest: ExcessResidual) -> float:
    """Share of a residual's energy that is predictable, or no noise if that is more."""
    if rest.noise is None:
        return rest.predictable
    return max(1.0 - (rest.noise / rest.rms) ** 2, rest.predictable)


def _strongest(traced: SearchResult, i: int) -> tuple[int, float]:
    """The joint where candidate i explains most, in units of the noise, and that energy."""
    rest = traced.judge.without(i, traced.chosen)
    energies = {j: explained(traced, i, rest, [j]) for j in traced.candidates[i].rows}
    joint = max(energies, key=energies.__getitem__)
    return joint, max(energies[joint], 1e-300)


def explained(traced: SearchResult, i: int, rest: Sequence[int], joints: Sequence[int]) -> float:
    """Energy on some joints that candidate i takes off beside the rest, in units of the noise."""
    plain = traced.judge.plain
    return plain.energy_on(rest, joints) - plain.energy_on([*rest, i], joints)


def _same_quantity(
    traced: SearchResult, i: int, depends_on: Sequence[Covariate], joint_names: Sequence[str]
) -> bool:
    effect = traced.candidates[i].effect
    # Time belongs to no joint, and a column of the log neither.
    own = ("", effect.covariate, *(joint_names[j] for j in effect.joints))
    return any(each.like in effect.function_of and each.joint in own for each in depends_on)


def _impossible(traced: SearchResult, joint: int, quantities: tuple[str, ...]) -> tuple[float, str]:
    """The most that a candidate which cannot be so would explain, and its kind.

    Of those that depend on one of the `quantities`: what others explain is something else's.
    """
    judge, chosen = traced.judge, traced.chosen
    taken = {traced.candidates[i].place for i in chosen}
    singles = judge.plain.schur(chosen).singles
    near = [
        k
        for k, c in enumerate(traced.candidates)
        if joint in c.rows and c.place not in taken and singles[k].dof
        if not quantities or not c.effect.function_of or {*quantities} & {*c.effect.function_of}
    ]
    best, rest = (0.0, ""), judge.plain.energy_on(chosen, [joint])
    for k in sorted(near, key=lambda k: -singles[k].chi2)[:_TRIED]:
        together = [*chosen, k]
        energy = rest - judge.plain.energy_on(together, [joint])
        if energy > best[0] and not judge.allowed(judge.plain.solve(together), together, [k]):
            best = (energy, traced.candidates[k].effect.kind)
    return best
