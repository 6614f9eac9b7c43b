"""What a score holds, as frozen records."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import isfinite

from excite_cli.diagnosis.records import EffectRecord
from excite_cli.effects.base import Value
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.measurement.dataset import Finding
from excite_cli.shown.answer import Shown

# What a replay holds, as a frozen record.


@dataclass(frozen=True, repr=False)
class Replay(Shown):
    """RMS deviation [rad] (m) from the measured motion, by joint, of recorded torques played.

    `before` on the URDF untouched (None where that has no masses), `after` on the exported model;
    over `seconds` of the runs `names`. `lost`: models that left all bounds. `notes`: what the
    exported model cannot hold.
    """

    model: str
    names: tuple[str, ...]
    seconds: float
    before: dict[str, float] | None
    after: dict[str, float]
    lost: tuple[str, ...] = ()
    sliding: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def means(self) -> tuple[float | None, float]:
        """Mean over the joints, before and after."""
        before = None if self.before is None else sum(self.before.values()) / len(self.before)
        return before, sum(self.after.values()) / len(self.after)

    @property
    def good(self) -> bool:
        """Whether the deviation fell, or there is nothing to compare with."""
        before, after = self.means
        return before is None or after < before


@dataclass(frozen=True)
class ReplayedModel:
    """RMS deviation [rad] (m) of a model `name` by joint: `after` each horizon, and `whole`.

    `whole` is over the log. NaN where no log is as long as the horizon. `lost`: it left all bounds.
    """

    name: str
    after: dict[str, tuple[float, ...]]
    whole: dict[str, float]
    lost: bool = False

    @property
    def mean(self) -> float:
        """Of `whole` over the joints."""
        return sum(self.whole.values()) / len(self.whole)

    def means(self) -> tuple[float, ...]:
        """Of `after` over the joints."""
        return tuple(sum(each) / len(each) for each in zip(*self.after.values(), strict=True))


@dataclass(frozen=True, repr=False)
class SetPointReplay(Shown):
    """Recorded set points played on exported models with nothing that holds these.

    `models`: the URDF as described (if it has masses), another one if it was asked for, and the
    `model` itself; `starts` of each of the `horizons` [s] over `seconds` of the runs `names`.
    """

    model: str
    names: tuple[str, ...]
    seconds: float
    horizons: tuple[float, ...]
    starts: tuple[int, ...]
    models: tuple[ReplayedModel, ...]
    sliding: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def good(self) -> bool:
        """Whether the model is nearer to the robot than the first one, if there is another."""
        return len(self.models) == 1 or self.models[-1].mean < self.models[0].mean


@dataclass(frozen=True)
class RunExplanation:
    """What a run has that the model has not: an effect, its `parameters`, and what it explains.

    `share` of the residual's energy, joints weighed by what the model allows them.
    """

    effect: EffectRecord
    parameters: dict[str, Value]
    share: float


@dataclass(frozen=True)
class HorizonDrift:
    """How far a simulation is from the robot `horizon` [s] after a start from a measured state.

    Deviations [rad] (m) by joint: the `median` and the `worst` of `starts`, and the medians of a
    robot that stands `still` and of one that keeps its speed (`steady`).
    """

    horizon: float
    starts: int
    median: dict[str, float]
    worst: dict[str, float]
    still: dict[str, float]
    steady: dict[str, float]

    @property
    def beyond(self) -> tuple[str, ...]:
        """Joints that drift farther than they move."""
        return tuple(joint for joint, x in self.median.items() if x >= self.still[joint])


@dataclass(frozen=True, repr=False)
class ScoredRun(Shown):
    """A run, or a part of it, beside the torque that the model predicts; nothing was fitted.

    `allowed` RMS of the residual by joint [N·m] (N) that the model's own residual allows in this
    motion, `ratio` to it of the RMS of what friction cannot explain (`beyond_friction`; NaN where
    the joint stands all the time); `peak` the same of the worst block of a second; empty where
    the model does not say. `alarm` where joints (`left`) are beyond that; `reasons` are what
    explains it best. `sums` (6, n): ‖e‖², ‖τ‖², the same where joints move, and both counts of
    samples. `covariates`: means of the log's declared columns. `epoch` of the recording's
    start [s], if known. `drift` of a simulation, for each horizon that the run is long enough for.
    """

    name: str
    file: str
    seconds: float
    error: Errors
    sums: tuple[tuple[float, ...], ...] = ()
    allowed: dict[str, float] = field(default_factory=dict)
    ratio: dict[str, float] = field(default_factory=dict)
    peak: dict[str, float] = field(default_factory=dict)
    left: tuple[str, ...] = ()
    reasons: tuple[RunExplanation, ...] = ()
    covariates: dict[str, float] = field(default_factory=dict)
    epoch: float | None = None
    drift: tuple[HorizonDrift, ...] = ()

    @property
    def alarm(self) -> bool:
        """Whether it leaves what the model's own residual allows."""
        return bool(self.left)

    @property
    def judged(self) -> tuple[str, ...]:
        """Joints of which something is left that friction cannot explain, so that it is judged."""
        return tuple(joint for joint, ratio in self.ratio.items() if isfinite(ratio))


@dataclass(frozen=True, repr=False)
class Score(Shown):
    """Runs beside a stored model. `error` of all runs together, `made` that when it was made.

    `not_simulated`: why no run has a drift.
    """

    model: str
    what: str
    joint_names: tuple[str, ...]
    units: tuple[str, ...]
    runs: tuple[ScoredRun, ...]
    error: Errors
    made: Errors | None
    held_out_run: str = ""
    noise: dict[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    not_simulated: str = ""

    @property
    def drift(self) -> tuple[HorizonDrift, ...]:
        """Of all runs: means, weighted by their starts, and the worst."""
        every = [each for run in self.runs for each in run.drift]
        return tuple(
            _together([each for each in every if each.horizon == horizon])
            for horizon in sorted({each.horizon for each in every})
        )

    @property
    def alarms(self) -> tuple[ScoredRun, ...]:
        """Runs that leave what the model's own residual allows."""
        return tuple(run for run in self.runs if run.alarm)


def _together(drifts: Sequence[HorizonDrift]) -> HorizonDrift:
    """Of one horizon."""
    starts = sum(each.starts for each in drifts)

    def mean(of: Callable[[HorizonDrift], dict[str, float]]) -> dict[str, float]:
        return {
            joint: sum(each.starts * of(each)[joint] for each in drifts) / starts
            for joint in of(drifts[0])
        }

    return HorizonDrift(
        drifts[0].horizon,
        starts,
        mean(lambda each: each.median),
        {joint: max(each.worst[joint] for each in drifts) for joint in drifts[0].worst},
        mean(lambda each: each.still),
        mean(lambda each: each.steady),
    )
