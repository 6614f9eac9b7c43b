"""What changed between days: every parameter with its test, corrected for their number.

A snapshot is what one file says: values with standard deviations, when, and what else the log says
of that day (a temperature). With y_k the values of one parameter on the days k = 1 … K,

    y_k = c + Σ_i a_i (x_ik − x̄_i) + d [k ≥ m] + e_k,    var e_k = s² (F σ_k² + (r c)²),

x the columns of the log that are taken out (with enough days their squares as well), d the change
and m the first day of it. F and r are added to a fit's own deviations (`_NARROW`, `_SYSTEMATIC`),
and s² ≥ 1 grows where the days scatter by more than all that. m is the day at which d explains
most; K − 1 of them were tried, and all parameters, and p is multiplied by both (Bonferroni). With
two days the change is a difference.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.regressor import PARAMETER_NAMES, standard_parameter_unit
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.fit import Fit
from excite_cli.identification.stored_model import StoredFit
from excite_cli.robot.model import Array
from excite_cli.scoring.records import Score
from excite_cli.shown.answer import Shown

SIGNIFICANT = 0.05
# Deviations of fits are too small by this factor (variance) over days: with 1.6, one of 17
# simulated years had a false change (p = 0.01), and true ones have p < 1e-6.
_NARROW = 2.5
_SYSTEMATIC = 0.003  # of the value
_FREE = 3  # degrees of freedom that must be left to take a column out


@dataclass(frozen=True)
class Known:
    """A value with its standard deviation and unit; `joint` that it belongs to, if one.

    `may_lack`: an effect that is looked for; where it was not found, it is zero. `quantity`: what
    joints have alike, in words; `friction` whether that is friction.
    """

    value: float
    std: float
    unit: str = ""
    joint: str = ""
    may_lack: bool = False
    quantity: str = ""
    friction: bool = False


@dataclass(frozen=True)
class Snapshot:
    """What one file says of its day: `known` by name, when, and means of the log's columns."""

    name: str
    known: Mapping[str, Known]
    epoch: float | None = None
    covariates: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Change(Shown):
    """A parameter over the days: `before` and `after` [unit] the day `since`, `std` of the change.

    `p_value` corrected for the number of parameters and days; `values` (K,) NaN where not known,
    `stds` likewise. `taken_out`: slopes per unit of the columns.
    """

    name: str
    joint: str
    unit: str
    before: float
    after: float
    std: float
    p_value: float
    since: str
    values: tuple[float, ...]
    stds: tuple[float, ...]
    taken_out: dict[str, float] = field(default_factory=dict)
    quantity: str = ""
    friction: bool = False

    @property
    def significant(self) -> bool:
        """Whether chance does not explain it."""
        return self.p_value < SIGNIFICANT

    @property
    def steps(self) -> float:
        """Its size in standard deviations, which orders those whose p is too small a number."""
        return (self.after - self.before) / self.std if self.std > 0.0 else 0.0


@dataclass(frozen=True, repr=False)
class Changes(Shown):
    """All parameters over the days, the surest change first."""

    days: tuple[str, ...]
    changes: tuple[Change, ...]
    columns: tuple[str, ...] = ()
    covariates: dict[str, tuple[float, ...]] = field(default_factory=dict)
    epochs: tuple[float | None, ...] = ()

    @property
    def significant(self) -> tuple[Change, ...]:
        """Those that chance does not explain."""
        return tuple(change for change in self.changes if change.significant)


def changes_of(snapshots: Sequence[Snapshot]) -> Changes:
    """What changed over the snapshots, which are in order of time."""
    columns = _columns(snapshots)
    names = list(dict.fromkeys(name for each in snapshots for name in each.known))
    tested = [
        found
        for name in names
        if (found := _change(name, snapshots, columns, len(names))) is not None
    ]
    return Changes(
        tuple(each.name for each in snapshots),
        tuple(sorted(tested, key=lambda each: (each.p_value, -abs(each.steps)))),
        tuple(columns),
        {name: tuple(map(float, x)) for name, x in columns.items()},
        tuple(each.epoch for each in snapshots),
    )


def _columns(snapshots: Sequence[Snapshot]) -> dict[str, Array]:
    """Columns of the log that all days know and that vary, if there are enough days for them."""
    shared = set.intersection(*(set(each.covariates) for each in snapshots))
    found = {
        name: np.array([each.covariates[name] for each in snapshots]) for name in sorted(shared)
    }
    found = {name: x for name, x in found.items() if np.ptp(x) > 1e-9 * np.abs(x).max()}
    most = max(len(snapshots) - 2 - _FREE, 0)
    return dict(list(found.items())[:most])


def _change(
    name: str, snapshots: Sequence[Snapshot], columns: Mapping[str, Array], family: int
) -> Change | None:
    one = next(each.known[name] for each in snapshots if name in each.known)
    given = [_given(name, each, one) for each in snapshots]
    y, std = (np.array(x) for x in zip(*given, strict=True))
    good = np.isfinite(y) & np.isfinite(std)
    if good.sum() < 2:
        return None
    own = np.flatnonzero(good)
    values, count = y[own], len(own)
    sigma = np.sqrt(_NARROW * std[own] ** 2 + (_SYSTEMATIC * np.abs(values)) ** 2)
    sigma = np.maximum(sigma, 1e-12 * max(np.abs(values).max(), 1e-300))
    beside = np.column_stack([np.ones(count), *(x[own] - x[own].mean() for x in columns.values())])
    if count - beside.shape[1] - 1 < _FREE:
        beside = beside[:, :1]
    squared = [(x[own] - x[own].mean()) ** 2 for x in columns.values()]
    if beside.shape[1] > 1 and count - beside.shape[1] - len(squared) - 1 >= 2 * _FREE:
        beside = np.column_stack([beside, *(each - each.mean() for each in squared)])
    steps = (_step(beside, values, sigma, m) for m in range(1, count))
    best = max(steps, key=lambda each: each[0])
    _, m, d, error, solved, p = best
    at = float(solved[0])
    return Change(
        name, one.joint, one.unit, at, at + d, error,
        float(min(1.0, p * (count - 1) * family)), snapshots[int(own[m])].name,
        tuple(map(float, y)), tuple(map(float, std)),
        {key: float(solved[1 + i]) for i, key in enumerate(columns) if beside.shape[1] > 1},
        one.quantity, one.friction,
    )  # fmt: skip


def _given(name: str, snapshot: Snapshot, one: Known) -> tuple[float, float]:
    if name in snapshot.known:
        return snapshot.known[name].value, snapshot.known[name].std
    return (0.0, one.std) if one.may_lack else (np.nan, np.nan)


def _step(
    beside: Array, values: Array, sigma: Array, m: int
) -> tuple[float, int, float, float, Array, float]:
    """|d| over its error for a change at day m; m, d, its error, all values, p of that."""
    count = len(values)
    columns = np.column_stack([beside, np.arange(count) >= m]) / sigma[:, None]
    y = values / sigma
    if np.linalg.matrix_rank(columns) < columns.shape[1]:
        return 0.0, m, 0.0, np.inf, np.zeros(columns.shape[1]), 1.0
    inverse = np.linalg.inv(columns.T @ columns)
    solved = inverse @ (columns.T @ y)
    free = count - columns.shape[1]
    error = np.sqrt(inverse[-1, -1])
    p_of = norm.sf
    if free >= _FREE:
        scatter = float(np.square(y - columns @ solved).sum()) / free
        if scatter > 1.0:
            error *= np.sqrt(scatter)

            def p_of(x: float) -> float:
                return float(student.sf(x, free))

    size = abs(float(solved[-1])) / float(error)
    return size, m, float(solved[-1]), float(error), solved, 2.0 * float(p_of(size))


# What a fit, a diagnosis or a score says of its day, as numbers that can be compared.

# By which such ratios differ between sound runs of different motions, one standard deviation:
# simulated ones lie between 0.9 and 1.9.
_OF_A_MOTION = 0.2


def of_fit(name: str, stored: StoredFit) -> Snapshot:
    """Base parameters and effects that the data fix."""
    fit = stored.fit
    known = {
        name: Known(float(fit.values[i]), float(fit.std[i]), fit.units[i])
        for i, name in enumerate(fit.names)
        if fit.identifiable[i]
    }
    for i, effect, label in _owners(fit):
        if fit.names[i] in known and len(effect.joints) == 1 and not effect.runs:
            known[fit.names[i]] = replace(
                known[fit.names[i]],
                joint=fit.joint_names[effect.joints[0]],
                quantity=_quantity(effect.kind, label),
                friction=effect.friction,
            )
    return Snapshot(name, known, stored.recorded.epoch, stored.recorded.covariates)


def _owners(fit: Fit) -> Iterator[tuple[int, Effect, str]]:
    """Every parameter of an effect by its place, the effect, and its name there."""
    at = fit.rank
    for effect in fit.effects:
        for parameter in effect.parameters:
            yield at, effect, parameter.name
            at += 1


def _quantity(kind: str, label: str) -> str:
    return f"{kind_named(kind).title}: {label}"


def of_diagnosis(name: str, found: Diagnosis) -> Snapshot:
    """Base parameters, the data-sheet lines of friction, and all other named effects.

    A base parameter has the name of its first term, as in a fit.
    """
    known = {
        base.split()[0]: Known(float(value), float(std), _unit_of(base))
        for base, value, std in zip(
            found.base_names, found.base_values, found.base_std, strict=True
        )
        if std < 0.5 * abs(value)
    }
    for line in found.friction_lines:
        for part, value in (("viscous", line.viscous), ("Coulomb", line.coulomb)):
            label = f"{part} friction[{line.joint}]"
            known[label] = Known(
                value.value, value.std, value.unit, line.joint, False, f"{part} friction", True
            )
    for named in found.effects:
        effect = named.effect
        if effect.runs or (len(effect.joints) == 1 and kind_named(effect.kind).friction):
            continue
        for label, value in named.parameters.items():
            if value.std == value.std:  # shapes have none
                place = ",".join(effect.joints)
                joint = effect.joints[0] if len(effect.joints) == 1 else ""
                known[f"{effect.kind}.{label}[{place}]"] = Known(
                    value.value, value.std, value.unit, joint, True,
                    _quantity(effect.kind, label), kind_named(effect.kind).friction,
                )  # fmt: skip
    return Snapshot(name, known, found.recorded.epoch, found.recorded.covariates)


def _unit_of(base: str) -> str:
    """The unit of a base parameter by the name of its first term, as `mz[elbow]`."""
    name = base.split("[")[0]
    return standard_parameter_unit(PARAMETER_NAMES.index(name)) if name in PARAMETER_NAMES else ""


def of_score(name: str, score: Score) -> list[Snapshot]:
    """Every run: RMS of each joint's residual over what the model allows."""
    return [
        Snapshot(
            f"{name}: {run.name}",
            {
                f"residual over allowed[{joint}]": Known(
                    ratio, _OF_A_MOTION * ratio, "1", joint, False, "residual over allowed"
                )
                for joint, ratio in run.ratio.items()
                if ratio == ratio
            },
            run.epoch,
            run.covariates,
        )
        for run in score.runs
    ]
