"""Candidates that the data at hand cannot tell from one that was named.

With the rest of the model projected off, c leaves Z_cc and its fitted signal has the energy
θᵀ Z_cc θ. What another candidate d cannot imitate of it is E = θᵀ (Z_cc − Z_cd Z_dd⁻¹ Z_dc) θ, and
the Kullback–Leibler divergence between the two is E/2: below 3 no test tells them apart reliably.
The data themselves may also be undecided where the divergence is larger: then the residual
energies of the two fits differ by less than 6.

Two named effects of one joint may be told from neither of them a single one, nor a named one from
two others together (`joint_aliases`): the same with the columns of two side by side. A kind that is
another name of effects that are all there (`same_as`) is told from none of them by any motion: that
is no doubt about them.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.judgement import Judgement
from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.diagnosis.records import ConfoundedCandidate
from excite_cli.diagnosis.schur import ABSORBED, SHARED, Schur
from excite_cli.effects.base import Effect, Place
from excite_cli.robot.model import Array

# Effects that would show as other values of inertial parameters only, and of which.

_NAMED = 4
_WORTH_NAMING = 0.15


def absorbed_effects(
    evidence: Evidence, candidates: Sequence[Candidate], chosen: Sequence[int], model: DeclaredModel
) -> tuple[ConfoundedCandidate, ...]:
    """Candidates of which the model leaves less than 0.1 % of their energy, and scales tell none.

    The model is the declared one with the chosen effects, which are named by their own parameters.
    What does not show in these data at all is not absorbed by anything. Only the first parameter
    counts (where a stiffness is absorbed, so is its effect, though the preload may show as an
    offset).
    """
    if model.vague:
        evidence = evidence.without_prior
    at, joint_names = evidence.columns(chosen), model.robot.joint_names
    factor, schur = evidence.factor(chosen), evidence.schur(chosen)
    found: dict[Place, ConfoundedCandidate] = {}
    effects = [candidates[i].effect for i in chosen]
    # A part of another name of what is named is reported with that name (`joint_aliases`).
    taken = {effect.place for effect in effects}
    taken |= {effect.place._replace(kind=kind) for effect in effects for kind in effect.same_as}
    names = [model.base.names[k] for k in model.base.selection]
    for effect in (*model.declared, *effects):
        where = "+".join(joint_names[j] for j in effect.joints)
        names += [f"{parameter.name}[{where}]" for parameter in effect.parameters]
    for i, c in enumerate(candidates):
        if c.place in taken or c.place in found or c.effect.runs or c.effect.refines:
            continue
        main = evidence.blocks[i][0]
        own = float(evidence.total[main, main])
        if own <= 0.0 or schur.identified_by_prior_only(i):
            continue
        columns = evidence.blocks[i] - evidence.fixed
        rest = schur.block(columns, columns)
        left = rest[0, 0] - rest[0, 1:] @ np.linalg.lstsq(rest[1:, 1:], rest[1:, 0], rcond=1e-9)[0]
        if left > ABSORBED * own:
            continue
        weight = np.abs(factor.solve(evidence.total[at, main]))
        order = np.argsort(-weight)
        by = [names[k] for k in order[:_NAMED] if weight[k] > _WORTH_NAMING * weight.max()]
        joints = tuple(joint_names[j] for j in c.effect.joints)
        found[c.place] = ConfoundedCandidate(
            c.effect.kind, joints, tuple(by), float(max(left, 0.0) / own)
        )
    return tuple(found.values())


UNDECIDED = 3.0  # KL divergence [nats]
_TRIED = 14  # candidates of one joint that are tried in pairs


@dataclass(frozen=True)
class Alias:
    """A candidate that might be meant instead, with the divergence from the named one."""

    candidate: int
    divergence: float


def aliases_of(
    named: int,
    rest: Sequence[int],
    taken: Collection[Place],
    candidates: Sequence[Candidate],
    white: Evidence,
    inflation: float,
    allowed: Callable[[Sequence[int], int], bool],
) -> list[Alias]:
    """Candidates that could replace `named` beside the `rest`, nearest first, one per place.

    Places in `taken` are named or declared already. By how much there is more of it in some runs is
    no other name of what all runs have: where `rest` lacks what refines it, that stands for what is
    lacking.

    A candidate with more parameters than the named one has more to explain it with and is no alias;
    `allowed(rest, d)` vetoes impossible signs.
    """
    schur = white.schur(rest)
    own = schur.gain(named)
    found: dict[tuple, Alias] = {}
    rows = set(candidates[named].rows)
    for i, c in enumerate(candidates):
        if c.place in taken or not rows & set(c.rows) or other_name(c.effect, taken):
            continue
        if c.effect.is_change and c.place._replace(runs=()) == candidates[named].place:
            continue
        other = schur.singles[i]
        if other.dof == 0 or other.dof > own.dof or other.chi2 < 0.5 * own.chi2:
            continue
        expected = 0.5 * _left(schur, white, [named], [i]) / inflation
        observed = 0.5 * (own.chi2 - other.chi2) / inflation
        divergence = min(expected, max(observed, 0.0))
        if divergence < UNDECIDED and allowed(rest, i):
            best = found.get(c.place)
            if best is None or divergence < best.divergence:
                found[c.place] = Alias(i, divergence)
    return sorted(found.values(), key=lambda alias: alias.divergence)


def other_name(effect: Effect, taken: Collection[Place]) -> tuple[Place, ...]:
    """The places, all of them `taken`, whose effects together are the same columns; () if not."""
    parts = tuple(Place(kind, effect.joints, effect.runs) for kind in effect.same_as)
    return parts if all(part in taken for part in parts) else ()


Members = tuple[int, ...]


def joint_aliases(
    chosen: Sequence[int], judge: Judgement, shown: Sequence[int]
) -> list[tuple[Members, Members]]:
    """For every one and every two of the `shown`, on one joint, what stands for them best.

    Of a single one it is a pair that these data cannot tell from it, where none of the two alone
    could stand for it; of two it is a single one.
    """
    local = [i for i in shown if _is_local(judge, i)]
    found: list[tuple[Members, Members]] = []
    for named in [*((i,) for i in local), *combinations(local, 2)]:
        if len({judge.candidates[i].rows for i in named}) > 1:
            continue
        best = min(_instead_of(named, chosen, judge), key=lambda each: each[0], default=None)
        if best is not None:
            found.append((named, best[1]))
    return found


def _is_local(judge: Judgement, i: int) -> bool:
    c = judge.candidates[i]
    return len(c.rows) == 1 and not c.effect.runs


def _instead_of(
    named: Members, chosen: Sequence[int], judge: Judgement
) -> Iterator[tuple[float, Members]]:
    """Divergence and members of all that could stand for the `named` ones."""
    rest = [k for k in chosen if k not in named]
    schur, inflation = judge.white.schur(rest), judge.rules.inflation
    whole = schur.gain(*named, absorbed=SHARED).chi2
    enough = whole - 2.0 * UNDECIDED * inflation
    taken = {judge.candidates[k].place for k in chosen}
    shut = {place for k in rest for place in judge.excluded(k)}
    free = [
        k
        for k, c in enumerate(judge.candidates)
        if c.rows == judge.candidates[named[0]].rows
        and c.place not in taken | shut
        and _is_local(judge, k)
        and schur.singles[k].dof
    ]
    if len(named) == 2:
        tried: list[tuple[Members, float]] = [((k,), schur.singles[k].chi2) for k in free]
    else:
        free = [k for k in free if judge.candidates[k].width == 1]
        free = [k for k in free if schur.singles[k].chi2 < enough]
        free.sort(key=lambda k: -schur.singles[k].chi2)
        few = sorted(free[:_TRIED])
        pairs = [pair for pair in combinations(few, 2) if judge.together(*pair)]
        chi2s = schur.pair_chi2(*np.array(pairs).T) if pairs else np.zeros(0)
        tried = list(zip(pairs, map(float, chi2s), strict=True))
    for others, chi2 in tried:
        expected = _left(schur, judge.white, named, others)
        divergence = 0.5 * min(expected, max(whole - chi2, 0.0)) / inflation
        together = [*rest, *others]
        if divergence < UNDECIDED and judge.allowed(judge.plain.solve(together), together, others):
            yield divergence, others


def _left(schur: Schur, white: Evidence, named: Sequence[int], others: Sequence[int]) -> float:
    """Energy of the fitted signal of the named ones that the others cannot imitate."""
    c, d = (
        np.concatenate([white.blocks[k] for k in each]) - white.fixed for each in (named, others)
    )
    theta = _solve(schur.block(c, c), schur.cross[c])
    mixed = schur.block(d, c) @ theta
    whole = float(theta @ schur.block(c, c) @ theta)
    return max(0.0, whole - float(mixed @ _solve(schur.block(d, d), mixed)))


def _solve(matrix: Array, rhs: Array) -> Array:
    return np.asarray(np.linalg.lstsq(matrix, rhs, rcond=1e-6)[0])
