"""Parameters of the declared model from measured runs: τ = Y_B φ_B + Σ effects' columns · θ + e.

Base parameters and all linear parameters of the effects are fitted together. With the URDF's
inertias kept (`inertias: cad`), a prior on φ_B is added. Columns of effects that look at the
model's own torque (friction that grows with load) are rebuilt with what was found, until it
settles. If asked, a physically consistent full set of standard parameters is found as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from excite_cli.config.data_spec import IdentificationSpec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import InertialPrior, body_lengths, inertial_prior
from excite_cli.dynamics.regressor import standard_parameter_unit, standard_parameters
from excite_cli.effects.base import Effect, Parameter, Value
from excite_cli.effects.parameter import unit_of_slider
from excite_cli.fields import shape
from excite_cli.identification.consistent import (
    ConsistentParameters,
    consistent_near_prior,
    consistent_parameters,
)
from excite_cli.identification.factors import Mask, solve, triangle_of
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.implausible_links import marked
from excite_cli.identification.least_squares import LinearFit, fit_rows
from excite_cli.identification.link_changes import LinkChange, inertial_covariance, link_changes
from excite_cli.identification.prior import as_wide_as_needed, prior_of
from excite_cli.identification.regression import Regression, follows_model, places_of, rebuilt
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.answer import Shown

# A parameter is identifiable if the data fix it to this share of its value or usual size.
_FIXED = 0.5
_KNOWN_BEYOND_PRIOR = 0.7
_REBUILDS, _SETTLED = 12, 1e-4
# Essential: what the data fix to a share this many times the best one's, or to this share at all.
_RATIO, _WELL_KNOWN = 10.0, 0.2


@dataclass(frozen=True, repr=False)
class Fit(Shown):
    """What was identified.

    All of (p,): `names`, `units`, `values`, `std`, `relative_std`, `identifiable`, `essential`;
    the first `rank` are base parameters, the rest the effects' linear parameters in order.
    `covariance` (p, p) holds infinity on the diagonal for what the data do not show. `noise` (n,)
    [N·m] of the filtered torque. `phi` (P,) full standard parameters with these base parameters,
    nearest to the URDF's; `consistent` those of real bodies, and `links` what these are beside the
    URDF's (none without them). `samples`: independent ones that the data are worth, of `count`.
    With the URDF's inertias kept, nothing is dropped: `essential` is `identifiable`. `kept`: names
    of base parameters that the data hardly show and that keep to the URDF for that.
    """

    method: str
    inertias: str
    joint_names: Annotated[tuple[str, ...], shape("n")]
    effects: tuple[Effect, ...]
    rank: int
    names: Annotated[tuple[str, ...], shape("p")]
    units: Annotated[tuple[str, ...], shape("p")]
    words: Annotated[tuple[str, ...], shape("p")]
    values: Annotated[Array, shape("p", finite=True)]
    std: Annotated[Array, shape("p")]
    relative_std: Annotated[Array, shape("p")]
    identifiable: Annotated[Mask, shape("p")]
    essential: Annotated[Mask, shape("p")]
    covariance: Annotated[Array, shape("p", "p")]
    noise: Annotated[Array, shape("n")]
    phi: Annotated[Array, shape("P", finite=True)]
    count: int
    samples: float
    consistent: ConsistentParameters | None = None
    links: tuple[LinkChange, ...] = ()
    kept: tuple[str, ...] = ()

    @property
    def base_values(self) -> Array:
        """φ_B (r,)."""
        return self.values[: self.rank]

    def effect_values(self, index: int) -> Array:
        """Linear parameters of effect `index`."""
        return self.values[self._part(index)]

    def consistent_effect_values(self, index: int) -> Array:
        """As `effect_values`, of the physically consistent set if there is one."""
        part = self._part(index)
        return self.best_model.values[part.start - self.rank : part.stop - self.rank]

    def effect_report(self, index: int) -> dict[str, Value]:
        """Parameters of effect `index` as people know them."""
        part, effect = self._part(index), self.effects[index]
        found = effect.report(self.values[part], self.covariance[part, part])
        if self.units[part] == tuple(parameter.unit for parameter in effect.parameters):
            return found
        return {k: replace(each, unit=unit_of_slider(each.unit)) for k, each in found.items()}

    def best_phi(self) -> Array:
        """φ (P,): the consistent set if there is one, else `phi`."""
        return self.best_model.phi

    @property
    def model(self) -> IdentifiedModel:
        """What it predicts with: `phi` and the effects."""
        return IdentifiedModel(self.phi, self.effects, self.values[self.rank :])

    @property
    def best_model(self) -> IdentifiedModel:
        """As `model`, of the physically consistent set if there is one."""
        if self.consistent is None:
            return self.model
        return IdentifiedModel(self.consistent.phi, self.effects, self.consistent.effects)

    def _part(self, index: int) -> slice:
        return places_of(self.effects, len(self.values))[index]


def fit(
    regression: Regression,
    spec: IdentificationSpec | None = None,
    known: tuple[Array, Array] | None = None,
) -> Fit:
    """Fit the declared model to all runs of `regression`.

    `known` = (A (m, p), b (m,)) adds ‖A x − b‖² of all parameters, base parameters first, in units
    of standard deviations.
    """
    spec = spec or IdentificationSpec()
    robot, base = regression.robot, regression.base
    parameters = effect_parameters(regression.effects)
    cad = standard_parameters(robot)
    none = np.zeros((0, base.rank + len(parameters) + 1))
    more = none if known is None else np.column_stack(known)
    given = prior_of(spec, robot, len(more) > 0)
    regression, linear, given = _settled(regression, spec, given, more)
    found = _record(regression, spec, linear, given)
    if not spec.consistent:
        return found
    prior = given or inertial_prior(robot, cad, 1.0)
    signs = np.array([parameter.nonnegative for parameter in parameters], bool)
    # What `cad` is worth is the user's word; where inertias are free nobody said.
    solve_for = consistent_parameters if spec.inertias == "cad" else consistent_near_prior
    factor = triangle_of(np.concatenate([linear.factor, more]))
    consistent = solve_for(factor, base, prior, body_lengths(robot, cad), signs)
    if not consistent.solved:
        return replace(found, consistent=consistent)
    # As many samples as there are independent ones.
    share = float(np.clip(linear.samples / max(int(linear.count.sum()), 1), 1e-6, 1.0))
    weaker = triangle_of(np.concatenate([linear.factor * np.sqrt(share), more]))
    covariance = inertial_covariance(weaker, base, prior)
    links = link_changes(robot, consistent.phi, covariance, prior)
    links = marked(robot, links, consistent.phi, covariance, prior)
    return replace(found, consistent=consistent, links=links)


def _settled(
    regression: Regression, spec: IdentificationSpec, prior: InertialPrior | None, more: Array
) -> tuple[Regression, LinearFit, InertialPrior | None]:
    """Fit, with columns that follow the model rebuilt until their torque settles.

    `prior` on inertias, which comes back as wide as it was needed, and rows `more` [A b] on all
    parameters.
    """
    robot, base = regression.robot, regression.base
    completion = inertial_prior(robot, standard_parameters(robot), 1.0)
    sizes = usual_sizes(robot, base, regression.effects)

    def fitted(prior: InertialPrior | None) -> tuple[Array, LinearFit]:
        rows = more
        if prior is not None:
            rows = np.concatenate([more, prior.rows(base, len(sizes) - base.rank)])
        given = rows[:, :-1], rows[:, -1]
        found = fit_rows([run.rows for run in regression.runs], spec.method, given, sizes)
        return found.x, found

    if prior is None or spec.inertias == "cad":
        linear = fitted(prior)[1]
    else:
        prior, linear = as_wide_as_needed(prior, base, fitted)
    for _ in range(_REBUILDS if follows_model(regression) else 0):
        values = linear.x[base.rank :]
        before = np.concatenate([run.effects @ values for run in regression.runs])
        phi = completion.completed(base, linear.x[: base.rank])
        regression = rebuilt(regression, phi, values)
        after = np.concatenate([run.effects @ values for run in regression.runs])
        linear = fitted(prior)[1]
        if np.linalg.norm(after - before) <= _SETTLED * max(float(np.linalg.norm(before)), 1e-12):
            break
    return regression, linear, prior


def usual_sizes(robot: Robot, base: BaseParameters, effects: Sequence[Effect]) -> Array:
    """How large parameters (r + k,) usually are: base parameters, then those of the effects."""
    prior = inertial_prior(robot, standard_parameters(robot), 1.0)
    return np.append(prior.base_std(base), [p.high for p in effect_parameters(effects)])


def _record(
    regression: Regression,
    spec: IdentificationSpec,
    linear: LinearFit,
    prior: InertialPrior | None,
) -> Fit:
    robot, base, effects = regression.robot, regression.base, regression.effects
    completion = inertial_prior(robot, standard_parameters(robot), 1.0)
    parameters = effect_parameters(effects)
    std, r = np.sqrt(np.diag(linear.covariance)), base.rank
    size = np.abs(linear.x)
    relative = np.where(size > 0, std / np.where(size > 0, size, 1.0), np.inf)
    usual = (prior or completion).base_std(base)
    smallest = np.array([parameter.low for parameter in parameters])
    kept = np.zeros(r, bool)
    if prior is not None:  # known by the data, if they say more than the prior does
        known = std[:r] <= _KNOWN_BEYOND_PRIOR * usual
        kept = ~known
    else:
        known = (relative[:r] <= _FIXED) | (std[:r] <= _FIXED * usual)
    fixed = (relative[r:] <= _FIXED) | (std[r:] <= smallest)
    identifiable = linear.seen & np.concatenate([known, fixed])
    return Fit(
        method=spec.method,
        inertias=spec.inertias,
        joint_names=robot.joint_names,
        effects=effects,
        rank=r,
        names=(
            *(base.names[index] for index in base.selection),
            *effect_parameter_names(effects, robot.joint_names),
        ),
        units=(
            *(standard_parameter_unit(index) for index in base.selection),
            *(
                effect.unit_on(parameter.unit, robot.sliding)
                for effect in effects
                for parameter in effect.parameters
            ),
        ),
        words=(*base.in_words(), *("" for _ in parameters)),
        values=linear.x,
        std=std,
        relative_std=relative,
        identifiable=identifiable,
        essential=identifiable if spec.inertias == "cad" else essential(linear.factor, std),
        covariance=linear.covariance,
        noise=linear.noise,
        phi=completion.completed(base, linear.x[:r]),
        count=int(linear.count.sum()),
        samples=linear.samples,
        kept=tuple(base.names[index] for index in base.selection[kept]),
    )


def essential(factor: Array, std: Array) -> Mask:
    """Which parameters (p,) are left when those that the data hardly fix are dropped.

    Stepwise (Pham & Gautier 1991): while the largest relative standard deviation is more than ten
    times the smallest, its parameter is set to zero and the rest fitted again. A model that
    predicts as well with fewer parameters; a dropped one is small *or* badly excited.

    Parameters
    ----------
    factor: (p+1, p+1) of rows divided by their noise
    std: (p,) of the full fit, beside that for independent samples
    """
    p = len(std)
    plain = np.diag(solve(factor).inverse)
    with np.errstate(divide="ignore", invalid="ignore"):
        inflation = np.where(np.isfinite(std) & (plain > 0), std**2 / plain, 1.0)
    at = np.arange(p)
    while len(at):
        solution = solve(triangle_of(factor[:, np.append(at, p)])[: len(at) + 1])
        own, size = np.sqrt(np.diag(solution.inverse) * inflation[at]), np.abs(solution.x)
        relative = np.where(size > 0, own / np.where(size > 0, size, 1.0), np.inf)
        relative[~solution.seen] = np.inf
        if relative.max() <= max(_RATIO * float(relative.min()), _WELL_KNOWN):
            break
        at = np.delete(at, int(np.argmax(relative)))
    return np.isin(np.arange(p), at)


def effect_parameters(effects: Sequence[Effect]) -> tuple[Parameter, ...]:
    """Linear parameters of all effects, in the order of their columns; a change has either sign."""
    return tuple(
        replace(parameter, nonnegative=parameter.nonnegative and not effect.is_change)
        for effect in effects
        for parameter in effect.parameters
    )


def effect_parameter_names(
    effects: Sequence[Effect], joint_names: Sequence[str]
) -> tuple[str, ...]:
    """Names such as `viscous_friction.viscous[joint_1]`, with the runs of what is a change."""
    names = []
    for effect in effects:
        place = ",".join(joint_names[j] for j in effect.joints)
        if effect.is_change:
            place += f"; {', '.join(effect.runs)}"
        if effect.covariate:
            place += f"; {effect.covariate}"
        names += [f"{effect.kind}.{parameter.name}[{place}]" for parameter in effect.parameters]
    return tuple(names)
