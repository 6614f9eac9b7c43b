"""What a diagnosis found, as frozen records."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import isnan, nan
from typing import Annotated, Any

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.traces import Traces
from excite_cli.diagnosis.verdict import HeldOutVerdict, Verdict
from excite_cli.effects.base import Value
from excite_cli.effects.catalogue import catalogue
from excite_cli.fields import PUBLIC, shape
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.measurement.campaign_clock import Recorded
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.model import Array
from excite_cli.robot.tree import Skeleton
from excite_cli.shown.answer import Shown, offered


@dataclass(frozen=True)
class EffectRecord:
    """An effect by name: kind, names of its joints, shape, linear parameters, runs (all: empty).

    `link`: of something carried, the link in whose frame its numbers are told. `covariate`: the
    column of the log that it follows, if any.
    """

    kind: str
    joints: tuple[str, ...]
    shape: dict[str, float] = field(default_factory=dict)
    values: tuple[float, ...] = ()
    runs: tuple[str, ...] = ()
    link: str = ""
    covariate: str = ""

    @property
    def key(self) -> tuple[object, ...]:
        """What effects that differ in shape and values only have in common."""
        return self.kind, self.joints, self.runs, self.covariate


@dataclass(frozen=True)
class Approximation:
    """What an effect only comes near: a function of `covariates`, or what `kind` looks like too."""

    covariates: tuple[Covariate, ...] = ()
    kind: str = ""


def by_joint(names: Sequence[str], values: Iterable[float]) -> dict[str, float]:
    """Values by the names of the joints."""
    return dict(zip(names, map(float, values), strict=True))


def mean_of_known(values: Iterable[float]) -> float:
    """Mean over the joints of which it is known; NaN if of none."""
    known = [float(each) for each in values if not isnan(each)]
    return sum(known) / len(known) if known else nan


@dataclass(frozen=True)
class ErrorReduction:
    """By how much an effect lowers a joint's error on held-out data: relative, and RMS [N·m]."""

    relative: float
    relative_moving: float
    rms: float


@dataclass(frozen=True, repr=False)
class NamedEffect(Shown):
    """An effect that the declared model lacks, with its evidence.

    `parameters` as people know them; `p_value` corrected for the family of tests, told down to
    `least_p`;
    `share_of_residual` of the energy of the residual before, on the rows it touches;
    `gain` by which the error on runs left out fell; `aliases` what the data cannot tell it from.
    If it is only an approximation, `approximates` says of what. `verdict` and `removes` (by joint)
    tell the error on held-out data without it from that with it, all others in; `parts` (by joint)
    of all effects add up to `before.relative_moving` − `after.relative_moving` (`error_parts`),
    with kept inertias to `untouched` − `after` together with `inertia_parts`.
    """

    effect: EffectRecord
    parameters: dict[str, Value]
    p_value: float
    share_of_residual: float
    gain: float
    aliases: tuple[EffectRecord, ...] = ()
    approximates: Approximation | None = None
    least_p: float = 0.0
    verdict: HeldOutVerdict | None = None
    removes: dict[str, ErrorReduction] = field(default_factory=dict)
    parts: dict[str, float] = field(default_factory=dict)

    @property
    def error_reduction(self) -> float:
        """Its part of the fall of the mean relative error on held-out data; NaN if not known."""
        return mean_of_known(self.parts.values())


@dataclass(frozen=True)
class Textbook:
    """The everyday effects (`effects.catalogue`) as far as training data left out ask for them.

    `effects` beside the declared ones, with their values; `error` on the held-out data.
    """

    effects: tuple[EffectRecord, ...]
    error: Errors


@dataclass(frozen=True)
class FrictionLine:
    """Viscous and Coulomb friction of a joint as data sheets give it.

    The straight line f_v v + f_c sgn v nearest to all friction of the joint over the speeds in the
    training data; `curved` where that is more than the two terms themselves. `kinds` are those that
    were found on this joint alone; where these are several, `verdict`, `removes` and `parts` are of
    all of them together, as of a `NamedEffect`. `fastest` [rad/s; m/s] of the training data: of
    higher speeds the line says nothing. Files of older versions do not have it.
    """

    joint: str
    viscous: Value
    coulomb: Value
    curved: bool
    kinds: tuple[str, ...] = ()
    verdict: HeldOutVerdict | None = None
    removes: dict[str, ErrorReduction] = field(default_factory=dict)
    parts: dict[str, float] = field(default_factory=dict)
    fastest: float = nan


@dataclass(frozen=True)
class JointAlias:
    """Effects that the data cannot tell from those that are `named`; one side is a pair.

    No motion can, where the one is another name of the pair.
    """

    named: tuple[EffectRecord, ...]
    others: tuple[EffectRecord, ...]

    @property
    def same_torque(self) -> bool:
        """Whether the one is the same columns as the pair, of any data."""
        one, several = sorted((self.named, self.others), key=len)
        kind = catalogue().get(one[0].kind)
        return kind is not None and set(kind.same_as) == {each.kind for each in several}


@dataclass(frozen=True)
class ConfoundedCandidate:
    """A candidate that shows as a change of parameters of the declared model only."""

    kind: str
    joints: tuple[str, ...]
    by: tuple[str, ...]
    left: float


@dataclass(frozen=True)
class ExcessResidual:
    """More than noise is left of the torque of `joint` once all effects are in (training data).

    `rms` of the filtered residual and `noise` [N·m] (N), this by its `basis`: `periods` that were
    repeated, or the `band` of the torque above the motion; None and empty where it is not known.
    If it is not `certain`, noise (with a memory, or of unknown size) could be as large.
    `predictable`: share of the residual's energy that is predicted on stretches left out, by all
    quantities or by those of `depends_on`, the one or two that predict most; empty if none does.
    `at_reversals`: the samples that fits count are at the noise; `rms` is of all in motion.
    """

    joint: str
    rms: float
    share_of_torque: float
    noise: float | None
    basis: str
    certain: bool
    predictable: float
    depends_on: tuple[Covariate, ...]
    at_reversals: bool = False


@dataclass(frozen=True)
class Assumption:
    """An effect of single `runs` was taken to be `present` in what is held out, or to be absent."""

    kind: str
    runs: tuple[str, ...]
    held_out: tuple[str, ...]
    present: bool
    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class HeldOutEnds:
    """Errors on the ends of training `runs`, held-out since these carry `effects` of their own."""

    runs: tuple[str, ...]
    effects: tuple[EffectRecord, ...]
    before: Errors
    after: Errors


@dataclass(frozen=True)
class Suspect:
    """One candidate in one round, with its evidence and what became of it.

    `why`: what makes its size impossible, where that is the verdict.
    """

    effect: EffectRecord
    p_value: float
    share_of_residual: float
    gain: float
    verdict: Verdict
    least_p: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class Round:
    """One round of tracing: residual per joint [N·m], the suspects, the verdict."""

    index: int
    residual: dict[str, float]
    suspects: tuple[Suspect, ...]
    verdict: str


@dataclass(frozen=True)
class Information:
    """What the training data say, for planning the next motion.

    `factor` R (k, k) with RᵀR = Σ cᵀc of the columns [base parameters, `model` effects, `rivals`,
    `possible`], each effect with all its linear parameters in order, rows weighted by 1/noise and
    whitened. `possible`: what was tested and not found, of kinds that many robots have.
    `noise` (n,) per moved joint [N·m] belongs to independent samples.
    """

    factor: Annotated[Array, shape("rows", "k", finite=True)]
    rank: int
    model: tuple[EffectRecord, ...]
    rivals: tuple[EffectRecord, ...]
    noise: Annotated[Array, shape("n", finite=True)]
    possible: tuple[EffectRecord, ...] = ()

    def columns_of(self, effects: Sequence[EffectRecord]) -> list[int] | None:
        """Of the base parameters, then of `effects` in their order; None if it lacks one."""
        at: dict[tuple[object, ...], range] = {}
        start = self.rank
        for record in (*self.model, *self.rivals, *self.possible):
            end = start + len(record.values)
            at.setdefault(record.key, range(start, end))
            start = end
        if start > self.factor.shape[1] or not all(each.key in at for each in effects):
            return None
        return [*range(self.rank), *(k for each in effects for k in at[each.key])]


OPEN_SETUP = "open_setup"  # the kind of a finding: the set-up is in doubt
HELD_OUT_DIFFERS = "held_out_differs"  # the kind of a finding: its error is far larger
CUT_SHORT = "cut_short"  # the kind of a finding: the search did not come to its end
_UNCHANGED = 0.02  # of an error that no effect concerns


def _lower(before: Errors, after: Errors, least: float = 1.0) -> bool:
    return not after.mean_relative >= least * before.mean_relative


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """All that `excite diagnose` learned. `phi`: full standard parameters that fit the data.

    `effects`: all that were added to the declared model. `noise_floor` [N·m] (N): RMS per joint of
    what changes from period to period in training runs, filtered as for the errors; None if no
    motion was repeated. `parts`: errors on what is held out beside the held-out run. `traces` of
    the training data, `held_out_traces` of the held-out ones. `untouched`: errors on the held-out
    data of the URDF as given, with the friction of its <dynamics>; None where it has no mass.
    `textbook`: the model that any other must be better than. `inertia_parts` (by joint): what the
    fit of kept inertias takes off, from that on; empty where they are free. `inertia_names`: of
    `phi`, as `m[elbow]`; `declared` effects have the values that belong to it. `trained`: errors of
    the model with effects on the data that it was fitted to.
    `skeleton`: where the joints are, to draw the robot, `recorded`: when.
    """

    config: str
    config_folder: str
    fingerprint: str
    joint_names: Annotated[tuple[str, ...], shape("n")]
    base_names: Annotated[tuple[str, ...], shape("r")]
    declared: tuple[EffectRecord, ...]
    effects: tuple[NamedEffect, ...]
    absorbed: Annotated[tuple[ConfoundedCandidate, ...], PUBLIC]
    held_out_run: str
    before: Errors
    after: Errors
    rounds: Annotated[tuple[Round, ...], PUBLIC]
    findings: Annotated[tuple[Finding, ...], PUBLIC]
    processing: Annotated[dict[str, Any], PUBLIC]
    phi: Annotated[Array, shape("P", finite=True)]
    base_values: Annotated[Array, shape("r")]
    base_std: Annotated[Array, shape("r")]
    information: Information
    versions: dict[str, str]
    seconds: Annotated[float, PUBLIC] = 0.0
    noise_floor: Annotated[dict[str, float] | None, PUBLIC] = None
    traces: Traces | None = None
    held_out_traces: tuple[TorqueTrace, ...] = ()
    assumed: Annotated[tuple[Assumption, ...], PUBLIC] = ()
    parts: tuple[HeldOutEnds, ...] = ()
    untouched: Errors | None = None
    textbook: Textbook | None = None
    excess_residuals: Annotated[tuple[ExcessResidual, ...], PUBLIC] = ()
    joint_aliases: tuple[JointAlias, ...] = ()
    friction_lines: Annotated[tuple[FrictionLine, ...], PUBLIC] = ()
    inertia_parts: dict[str, float] = field(default_factory=dict)
    inertia_names: tuple[str, ...] = ()
    trained: Errors | None = None
    skeleton: Skeleton | None = None
    recorded: Recorded = field(default_factory=Recorded)

    def plot_residual(self, joint: str | None = None, ax: Any = None) -> Any:
        """Torque of the held-out run in time, and what both models leave of it [N·m] (N).

        A row per joint; measured torque and the declared model's residual are dots, the model with
        effects is a line. In `ax` (matplotlib) one joint's residual. Axes are returned.

        Raises ConfigError for another joint, MissingExtraError without matplotlib.
        """
        return offered(self)["plot_residual"](self, joint, ax)

    def plot_friction(self, joint: str, ax: Any = None) -> Any:
        """Friction [N·m] (N) that was found on a joint, over its speed: measured, and the law.

        Measured (dots): the training data's torque less all else in the model. Axes are returned.

        Raises ConfigError where none was found, MissingExtraError without matplotlib.
        """
        return offered(self)["plot_friction"](self, joint, ax)

    @property
    def torque_units(self) -> tuple[str, ...]:
        """N·m of joints that turn, N of those that slide; empty texts where no torque was kept."""
        return self.traces.torque_units if self.traces else ("",) * len(self.joint_names)

    @property
    def baseline(self) -> Errors:
        """Errors where the way begins along which effects take their parts off."""
        return self.untouched if self.inertia_parts and self.untouched else self.before

    @property
    def fall(self) -> float:
        """By how much the mean relative error on the held-out data fell, where joints move."""
        return self.baseline.mean_relative_moving - self.after.mean_relative_moving

    @property
    def good(self) -> bool:
        """Whether what was found predicts the held-out data better than the declared model does,
        and no worse than the textbook's."""
        return self.fell and not self.worse_than_textbook

    @property
    def fell(self) -> bool:
        """Whether what was found, if anything, lowers the mean error on the held-out data.

        Where nothing of it is in the held-out run, that error need not fall, but must not rise; it
        is on the held-out ends of the runs that carry it that the error falls. Nor need it fall by
        what based on the known mass.
        """
        absent = {(each.kind, each.runs) for each in self.assumed if not each.present}
        if self.effects and all(
            each.verdict is HeldOutVerdict.WEIGHED or (each.effect.kind, each.effect.runs) in absent
            for each in self.effects
        ):
            ends = all(_lower(part.before, part.after) for part in self.parts)
            return ends and _lower(self.before, self.after, 1.0 + _UNCHANGED)
        return not self.effects or _lower(self.before, self.after)

    @property
    def worse_than_textbook(self) -> bool:
        """Whether the textbook's model leaves clearly less of the held-out data."""
        if self.textbook is None:
            return False
        least = self.textbook.error.mean_relative_moving
        return self.after.mean_relative_moving > rules.AS_GOOD * least

    @property
    def harmful(self) -> tuple[NamedEffect, ...]:
        """Effects without which the error on the held-out data is lower."""
        return tuple(each for each in self.effects if each.verdict is HeldOutVerdict.HARMFUL)

    @property
    def named(self) -> tuple[NamedEffect, ...]:
        """Effects that are what their names say."""
        return tuple(each for each in self.effects if not each.approximates)

    @property
    def unexplained(self) -> tuple[ExcessResidual, ...]:
        """What is left and depends on something, in a form that no effect has."""
        return tuple(each for each in self.excess_residuals if each.depends_on)

    @property
    def joints_with_residual(self) -> tuple[str, ...]:
        """Joints of whose torque structure, or surely more than noise, is left."""
        left = {each.joint for each in self.excess_residuals if each.certain}
        return tuple(joint for joint in self.joint_names if joint in left)

    @property
    def complete(self) -> bool:
        """Whether the declared model lacks nothing: no effect, and nothing is left but noise."""
        ended = any(each.kind == CUT_SHORT for each in self.findings)
        return not (self.effects or self.joints_with_residual or ended)

    @property
    def approximations(self) -> tuple[NamedEffect, ...]:
        """Effects that lower the error, but only come near what is really there."""
        return tuple(each for each in self.effects if each.approximates)
