"""Parameters of the declared model from measured runs: τ = Y_B φ_B + Σ effects' columns · θ + e.

Base parameters and all linear parameters of the effects are fitted together. With the URDF's
inertias kept (`inertias: cad`), a prior on φ_B is added. Columns of effects that look at the
model's own torque (friction that grows with load) are rebuilt with what was found, until it
settles. If asked, a physically consistent full set of standard parameters is found as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import IdentificationSpec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import body_lengths
from excite_cli.dynamics.regressor import standard_parameter_unit, standard_parameters
from excite_cli.effects.base import Effect, Parameter, Value
from excite_cli.effects.parameter import unit_of_slider
from excite_cli.identification.consistent import ConsistentParameters, consistent_parameters
from excite_cli.identification.consistent_spread import consistent_near_prior
from excite_cli.identification.covariance import Rows
from excite_cli.identification.essential import essential_parameters
from excite_cli.identification.factors import Mask, solve, triangle_of
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.implausible_links import marked
from excite_cli.identification.least_squares import LinearFit, fit_rows
from excite_cli.identification.link_changes import LinkChange, inertial_covariance, link_changes
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.prior import (
    InertialPrior,
    as_wide_as_needed,
    inertial_prior,
    prior_of,
)
from excite_cli.identification.regression import (
    Regression,
    RunColumns,
    effect_columns,
    signals_of,
    with_effects,
)
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.record import Shown
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

# A parameter is identifiable if the data fix it to this share of its value or usual size.
_FIXED = 0.5
_KNOWN_BEYOND_PRIOR = 0.7
_REBUILDS, _SETTLED = 12, 1e-4
_PROBE = 60


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
    joint_names: tuple[str, ...]
    effects: tuple[Effect, ...]
    rank: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    words: tuple[str, ...]
    values: Array
    std: Array
    relative_std: Array
    identifiable: Mask
    essential: Mask
    covariance: Array
    noise: Array
    phi: Array
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
        if self.consistent is None:
            return self.effect_values(index)
        part = self._part(index)
        return self.consistent.effects[part.start - self.rank : part.stop - self.rank]

    def effect_report(self, index: int) -> dict[str, Value]:
        """Parameters of effect `index` as people know them."""
        part, effect = self._part(index), self.effects[index]
        found = effect.report(self.values[part], self.covariance[part, part])
        if self.units[part] == tuple(parameter.unit for parameter in effect.parameters):
            return found
        return {k: replace(each, unit=unit_of_slider(each.unit)) for k, each in found.items()}

    def best_phi(self) -> Array:
        """φ (P,): the consistent set if there is one, else `phi`."""
        return self.phi if self.consistent is None else self.consistent.phi

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
        first = self.rank + sum(len(e.parameters) for e in self.effects[:index])
        return slice(first, first + len(self.effects[index].parameters))


def all_rows(runs: Sequence[RunColumns]) -> list[Rows]:
    """Rows of every run for the least-squares fit."""
    return [Rows(run.columns, run.tau, run.usable, rounding=run.prepared.rounding) for run in runs]


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
    cad = standard_parameters(robot)
    keep = spec.inertias == "cad"
    more = np.column_stack(known) if known is not None and len(known[0]) else None
    given = prior_of(spec, robot, more is not None)
    regression, linear, given = _settled(regression, spec, given, more)
    found = _record(regression, spec, linear, given)
    if not spec.consistent:
        return found
    prior = given or inertial_prior(robot, cad, 1.0)

    def with_known(factor: Array) -> Array:
        return factor if more is None else triangle_of(np.concatenate([factor, more]))

    factor = with_known(linear.factor)
    signs = np.array([p.nonnegative for p in effect_parameters(regression.effects)], bool)
    # What `cad` is worth is the user's word; where inertias are free nobody said.
    solve_for = consistent_parameters if keep else consistent_near_prior
    consistent = solve_for(factor, base, prior, body_lengths(robot, cad), signs)
    if not consistent.solved:
        return replace(found, consistent=consistent)
    # As many samples as there are independent ones.
    share = float(np.clip(linear.samples / max(int(linear.count.sum()), 1), 1e-6, 1.0))
    covariance = inertial_covariance(with_known(linear.factor * np.sqrt(share)), base, prior)
    links = link_changes(robot, consistent.phi, covariance, prior)
    links = marked(robot, links, consistent.phi, covariance, prior)
    return replace(found, consistent=consistent, links=links)


def _settled(
    regression: Regression,
    spec: IdentificationSpec,
    prior: InertialPrior | None,
    more: Array | None,
) -> tuple[Regression, LinearFit, InertialPrior | None]:
    """Fit, with columns that follow the model rebuilt until their torque settles.

    `prior` on inertias, which comes back as wide as it was needed, and rows `more` [A b] on all
    parameters.
    """
    base = regression.base
    k = sum(len(effect.parameters) for effect in regression.effects)
    completion = inertial_prior(regression.robot, standard_parameters(regression.robot), 1.0)
    sizes = usual_sizes(regression.robot, base, regression.effects)

    def fitted(prior: InertialPrior | None) -> tuple[Array, LinearFit]:
        given = [] if more is None else [more]
        if prior is not None:
            given.append(prior.rows(base, k))
        found = fit_rows(all_rows(regression.runs), spec.method, _together(given), sizes)
        return found.x, found

    if prior is None or spec.inertias == "cad":
        linear = fitted(prior)[1]
    else:
        prior, linear = as_wide_as_needed(prior, base, fitted)
    for _ in range(_REBUILDS if follows_model(regression) else 0):
        before = [run.effects @ linear.x[base.rank :] for run in regression.runs]
        phi = completion.completed(base, linear.x[: base.rank])
        regression = rebuilt(regression, phi, linear.x[base.rank :])
        after = [run.effects @ linear.x[base.rank :] for run in regression.runs]
        linear = fitted(prior)[1]
        change = float(np.linalg.norm(np.concatenate(after) - np.concatenate(before)))
        if change <= _SETTLED * max(float(np.linalg.norm(np.concatenate(before))), 1e-12):
            break
    return regression, linear, prior


def usual_sizes(robot: Robot, base: BaseParameters, effects: Sequence[Effect]) -> Array:
    """How large parameters (r + k,) usually are: base parameters, then those of the effects."""
    prior = inertial_prior(robot, standard_parameters(robot), 1.0)
    return np.append(usual_of(base, prior), [p.high for p in effect_parameters(effects)])


def usual_of(base: BaseParameters, prior: InertialPrior) -> Array:
    """Standard deviations (r,) of base parameters by what the URDF is worth."""
    return np.sqrt(np.square(base.mapping) @ np.square(prior.std))


def _together(given: Sequence[Array]) -> tuple[Array, Array] | None:
    """Rows [A b] as A and b."""
    if not given:
        return None
    both = np.concatenate(given)
    return both[:, :-1], both[:, -1]


def follows_model(regression: Regression) -> bool:
    """Whether columns of the effects change with φ, tried on a few samples."""
    if not regression.effects or not regression.runs:
        return False
    prepared = regression.runs[0].prepared
    cut = slice(0, _PROBE)
    series = {name: getattr(prepared, name)[cut] for name in ("t", "q", "v", "a")}
    covariates = {name: values[cut] for name, values in prepared.covariates.items()}
    brief = replace(prepared, **series, covariates=covariates)
    cad = standard_parameters(regression.robot)
    one, other = (
        effect_columns(regression.effects, signals_of(brief, regression.robot, phi))
        for phi in (cad, 1.3 * cad)
    )
    return not np.allclose(one, other, rtol=1e-9, atol=1e-12)


def rebuilt(regression: Regression, phi: Array, values: Array) -> Regression:
    """The effects' columns again, with the rigid body at `phi` and effects of `values`."""
    spool, shared = Spool(), (regression.robot, regression.effects, phi, values)
    made = each(_again, shared, [(run.prepared, run.inertial) for run in regression.runs])
    runs = zip(regression.runs, made, strict=True)
    return replace(
        regression, runs=tuple(replace(run, columns=spool.keep(own)) for run, own in runs)
    )


def _again(
    shared: tuple[Robot, Sequence[Effect], Array, Array],
    task: tuple[PreparedRun, Array],
    tell: Tell,
) -> Array:
    (robot, effects, phi, values), (prepared, inertial) = shared, task
    signals = with_effects(signals_of(prepared, robot, phi), effects, values)
    own = prepared.averaged_for_fit(effect_columns(effects, signals))
    return np.concatenate([inertial, own], axis=2)


def _record(
    regression: Regression,
    spec: IdentificationSpec,
    linear: LinearFit,
    prior: InertialPrior | None,
) -> Fit:
    robot, base, effects = regression.robot, regression.base, regression.effects
    completion = inertial_prior(robot, standard_parameters(robot), 1.0)
    parameters = effect_parameters(effects)
    std = np.sqrt(np.diag(linear.covariance))
    size = np.abs(linear.x)
    relative = np.where(size > 0, std / np.where(size > 0, size, 1.0), np.inf)
    usual = usual_of(base, prior or completion)
    smallest = np.array([parameter.low for parameter in parameters])
    kept = np.zeros(base.rank, bool)
    if prior is not None:  # known by the data, if they say more than the prior does
        known = std[: base.rank] <= _KNOWN_BEYOND_PRIOR * usual
        kept = ~known
    else:
        known = (relative[: base.rank] <= _FIXED) | (std[: base.rank] <= _FIXED * usual)
    fixed = (relative[base.rank :] <= _FIXED) | (std[base.rank :] <= smallest)
    identifiable = linear.seen & np.concatenate([known, fixed])
    return Fit(
        method=spec.method,
        inertias=spec.inertias,
        joint_names=robot.joint_names,
        effects=effects,
        rank=base.rank,
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
        essential=identifiable if spec.inertias == "cad" else _essential(linear, std),
        covariance=linear.covariance,
        noise=linear.noise,
        phi=completion.completed(base, linear.x[: base.rank]),
        count=int(linear.count.sum()),
        samples=linear.samples,
        kept=tuple(base.names[index] for index in base.selection[kept]),
    )


def _essential(linear: LinearFit, std: Array) -> Mask:
    plain = np.diag(solve(linear.factor).inverse)
    with np.errstate(divide="ignore", invalid="ignore"):
        inflation = np.where(np.isfinite(std) & (plain > 0), std**2 / plain, 1.0)
    return essential_parameters(linear.factor, inflation, np.ones(len(std), bool))[0]


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
    places = [
        ",".join(joint_names[j] for j in effect.joints)
        + (f"; {', '.join(effect.runs)}" if effect.is_change else "")
        + (f"; {effect.covariate}" if effect.covariate else "")
        for effect in effects
    ]
    return tuple(
        f"{effect.kind}.{parameter.name}[{place}]"
        for effect, place in zip(effects, places, strict=True)
        for parameter in effect.parameters
    )
