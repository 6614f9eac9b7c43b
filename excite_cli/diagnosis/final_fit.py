"""The fit that is told: with honest deviations, and of possible sizes.

What a search has named is fitted by weighted least squares, with standard deviations that respect
serial correlation, what the columns of first-order effects leave, and shapes that fit as well.
Sizes that no effect can have are moved to the nearest possible ones, all other parameters with them
as the covariance says.

With f_v v + f_c sgn v + c sgn v·|v|^p in a model (or a part that grows with load or time), both
f_v and f_c are what that term leaves: for a concave curve even negative, or nothing. Whether there
is viscous and Coulomb friction is a question of the straight line through all of it: with the line
α v + β sgn v nearest to the curve over the speeds in the data, of f_v + c α and f_c + c β.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.arrays import Array, Mask
from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.dynamics.pseudo_inertia import InertialPrior
from excite_cli.effects.judgement import half_of
from excite_cli.identification.factors import solve, triangle_of, undecided
from excite_cli.identification.fit import usual_sizes
from excite_cli.identification.least_squares import LinearFit, fit_rows
from excite_cli.identification.prior import as_wide_as_needed
from excite_cli.identification.regression import places_of, width_of

# Relative sd of every size, beside what noise says: filters, differentiated positions and motion
# between samples. Of 940 sizes of simulated campaigns 91.3 % lay within two sd without it, 95.1 %
# with it.
_SYSTEMATIC = 0.004


@dataclass(frozen=True)
class FinalFit:
    """What is told: `parameters` (k,) of the whole model and `covariance`; `seen` in the data."""

    parameters: Array
    covariance: Array
    seen: Mask


def regression(traced: SearchResult, declared: DeclaredModel) -> LinearFit:
    """What was found beside the `declared` model, by the regression of `identify` (`wls`).

    Where the user leaves the inertias to the data, their prior is as wide as this fit asks for.
    """
    effects = (*declared.declared, *traced.effects)
    data = traced.data.rows(traced.candidates, traced.chosen)
    sizes = usual_sizes(declared.robot, declared.base, effects)
    rows, said = traced.imagined()

    def fitted(model: DeclaredModel) -> LinearFit:
        known = np.insert(model.known, [-1] * width_of(traced.effects), 0.0, axis=1)
        prior = np.vstack([known[:, :-1], rows]), np.append(known[:, -1], said)
        found = fit_rows(data, "wls", prior if len(prior[0]) else None, sizes)
        # Where data do not decide, what is imagined does, and tells nothing of it.
        told = triangle_of(np.concatenate([found.factor, known]))
        shown = found.shown + undecided(told, found.x)
        return replace(found, shown=shown, seen=solve(told).seen)

    def beside(prior: InertialPrior) -> tuple[Array, LinearFit]:
        found = fitted(replace(declared, prior=prior))
        return found.x, found

    if declared.prior is None or not declared.vague:
        return fitted(declared)
    return as_wide_as_needed(declared.prior, declared.base, beside)[1]


def final_fit(traced: SearchResult, linear: LinearFit) -> FinalFit:
    """What is told of a regression of what was found."""
    parameters, covariance = linear.x, linear.shown.copy()
    places = places_of(traced.effects, len(parameters))
    for k, (effect, own) in enumerate(zip(traced.effects, places, strict=True)):
        error = np.hypot(effect.model_error(parameters[own]), _SYSTEMATIC * parameters[own])
        covariance[own, own] += np.diag(error**2 + _by_shape(traced, k) ** 2)
    lines = friction_lines(traced, len(parameters))
    for effect, own in zip(traced.effects, places, strict=True):
        values = parameters[own]
        beside = np.delete(lines[own], own, axis=1).any()  # it is judged with what refines it
        if not beside and not effect.possible(values):
            whiten = np.linalg.inv(half_of(covariance[own, own]))
            shift = whiten.T @ (whiten @ (effect.nearest(values, covariance[own, own]) - values))
            parameters = parameters + covariance[:, own] @ shift
    return FinalFit(parameters, covariance, linear.seen)


def _by_shape(traced: SearchResult, member: int) -> Array:
    """Standard deviation (w,) of the sizes of a chosen effect that its uncertain shape brings.

    The sizes that it has in other shapes, weighted by exp(−Δχ²/2): so likely are these shapes, if
    physics allows the sizes, and they mean the same.
    """
    judge, chosen = traced.judge, traced.chosen
    own = traced.candidates[chosen[member]]
    sets, sizes = [chosen], [_size(traced, chosen, member)]
    for k, c in enumerate(traced.candidates):
        alike = c.place == own.place and c.width == own.width and k != chosen[member]
        if alike and own.effect.compares_with(c.effect):
            some = (*chosen[:member], k, *chosen[member + 1 :])
            if judge.allowed(judge.plain.solve(some), some, [k]):
                sets.append(some)
                sizes.append(_size(traced, some, member))
    if len(sets) < 2:
        return np.zeros(own.width)
    energies = np.array([judge.white.energy(each) for each in sets]) / traced.inflation
    weights = np.exp(-0.5 * (energies - energies.min()))
    return np.sqrt(weights @ np.square(np.array(sizes) - sizes[0]) / weights.sum())


def _size(traced: SearchResult, some: Sequence[int], member: int) -> Array:
    """Parameters of a member of a set of candidates, fitted with the others."""
    parameters = traced.judge.plain.solve(some)
    effects = [traced.candidates[i].effect for i in some]
    return np.asarray(parameters[places_of(effects, len(parameters))[member]])


def signal_to_error(traced: SearchResult, found: FinalFit) -> dict[int, float]:
    """Size over two standard deviations of every effect; of plain friction, that of the line."""
    count = len(found.parameters)
    lines = friction_lines(traced, count)
    shown, spread = lines @ found.parameters, lines @ found.covariance @ lines.T
    places = places_of(traced.effects, count)
    return {
        i: traced.candidates[i].effect.signal_to_error(shown[own], spread[own, own])
        for i, own in zip(traced.chosen, places, strict=True)
    }


def friction_lines(traced: SearchResult, count: int) -> Array:
    """T (k, k): all `count` parameters as they are judged = T @ parameters as fitted."""
    places = dict(zip(traced.chosen, places_of(traced.effects, count), strict=True))
    of_all_runs = {
        traced.candidates[i].place[:2]: i
        for i in traced.chosen
        if not traced.candidates[i].effect.runs
    }
    transform = np.eye(count)
    for i in traced.chosen:
        effect = traced.candidates[i].effect
        lines = [of_all_runs.get((kind, effect.joints)) for kind in effect.deviates_from]
        present = [k for k in lines if k is not None]
        if present:
            slopes = np.linalg.lstsq(
                np.concatenate([_first_row(traced, k) for k in present], axis=1),
                _first_row(traced, i),
                rcond=1e-9,
            )[0]
            transform[[places[k].start for k in present], places[i]] = slopes
    return transform


def _first_row(traced: SearchResult, i: int) -> Array:
    """Columns (M, w) of candidate i in its first row, where that is usable."""
    own = traced.candidates[i]
    masks = [run.usable[:, own.rows[0]] for run in traced.data.runs]
    return np.concatenate([c[mask, 0] for c, mask in zip(own.columns, masks, strict=True)])
