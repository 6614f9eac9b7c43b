"""Robots without torque sensors: what the position controller of their drives applies.

    τ(t) = kp (q*(t − d) − q(t − ε)) + kd (v*(t − d) − v(t − ε)) + τ_ff(t − d),    |τ| ≤ limit

with set points q* (speeds v* and torques τ_ff, where the drive takes any) that act the time d after
they were recorded, and gains kp [N·m/rad], kd [N·m·s/rad] at the joint. A set point stands until
the next one comes; what a joint feels over a sample is its average, which is q* interpolated half a
sample later. In the same way ε is half a period of the drive's own loop: kp ε of its damping, and
kd ε of a rotor, are taken away by that.

How long after a sample its set point came is not in the log: up to half a sample less, all times
alike. Nor is ε, which is as uncertain as it is long.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.dataset import Array, Run
from excite_cli.measurement.torque_sources.base import TorqueSource, per_joint, speeds_of

# [N·m/rad] for drives whose gain nobody told, until it is found in the data.
UNKNOWN_GAIN = 1.0


@dataclass(frozen=True)
class DriveLaw:
    """`kp` [N·m/rad], `kd` [N·m·s/rad], `limit` [N·m] (∞ without one), each (n,).

    `delay` d of set points, its standard deviation and `lag` ε of what the drive answers [s].
    `gain_half` (n, n) H: the logarithms of gains that were found have the covariance H Hᵀ.
    """

    kp: Array
    kd: Array
    limit: Array
    delay: float
    lag: float = 0.0
    delay_std: float = 0.0
    gain_half: Array | None = None

    def torque(self, run: Run) -> Array:
        """τ (T, n) [N·m] that the drives apply in a run with set points in its `extra`.

        0 of the joints of a base, which no drive moves.
        """
        late, driven = held(run, self.delay), slice(run.base_rows, None)
        tau = np.zeros_like(run.q)
        q, v = (_earlier(x[:, driven], run.t, self.lag) for x in (run.q, speeds_of(run)))
        own = self.kp * (late["q_cmd"] - q)
        own += self.kd * (late.get("v_cmd", 0.0) - v)
        own += late.get("tau_ff", 0.0)
        tau[:, driven] = np.clip(own, -self.limit, self.limit)
        return tau

    def of_smooth(self, run: Run, q: Array) -> Run:
        """The run with the torque that its drives apply at its positions smoothed, q (T, n).

        Noise of encoders times kp, and of their differences times kd, is many times that of the
        positions that all other columns are made of. What was added to the torque stays.
        """
        smooth = replace(run, q=q)
        return replace(run, tau=run.tau + self.torque(smooth) - self.torque(run))

    def unsure(self, run: Run) -> list[Array]:
        """Changes of τ (T, n) by one standard deviation: of the delay, and of ε."""
        later = self.delay + math.hypot(self.delay_std, hold_std(run))
        others, own = (replace(self, delay=later), replace(self, lag=0.0)), self.torque(run)
        return [law.torque(run) - own for law in others]

    def by_gains(self, tau: Array) -> Array:
        """Changes (k, M, n) of torques τ (M, n) by one standard deviation of gains, if found."""
        if self.gain_half is None:
            return np.zeros((0, *tau.shape))
        count = len(self.gain_half)
        changes = np.zeros((count, *tau.shape))
        changes[:, :, -count:] = tau[:, -count:] * self.gain_half.T[:, None, :]
        return changes


def hold_std(run: Run) -> float:
    """Standard deviation [s] of when a set point came, between two samples: uniform on half a step.

    Of simulated arms with set points at 50 Hz delays were found 0.9 to 3.3 ms off, with 2.9 so.
    """
    return run.step / (2.0 * math.sqrt(12.0)) if len(run.t) > 1 else 0.0


def held(run: Run, delay: float) -> Mapping[str, Array]:
    """What drives act upon `delay` [s] after it was sent: q*, and v*, τ_ff if there, (T, n)."""
    step = run.step if len(run.t) > 1 else 0.0
    at = run.t - delay - 0.5 * step
    found = {}
    for name in (*Command.channels, *Command.further):
        if name in run.extra:
            found[name] = _at(at, run.t, run.extra[name])
    return found


def _earlier(x: Array, t: Array, lag: float) -> Array:
    return _at(t - lag, t, x) if lag else x


def _at(times: Array, t: Array, x: Array) -> Array:
    """Columns x (T, n) at other times."""
    return np.stack([np.interp(times, t, column) for column in x.T], axis=1)


def law_of(spec: MeasurementSpec, joints: tuple[str, ...]) -> DriveLaw:
    """The law that a config tells of; what it leaves to the data is 1 N·m/rad and no delay."""
    told = spec.command
    return DriveLaw(
        per_joint(told.kp, joints, UNKNOWN_GAIN),
        per_joint(told.kd, joints, 0.0),
        per_joint(told.limit, joints, np.inf),
        told.delay or 0.0,
        0.5 * told.period,
    )


class Command(TorqueSource):
    """Position set points, and what the drive makes of them."""

    name = "command"
    title = "of the drive's law, from position set points"
    channels = ("q_cmd",)
    further = ("v_cmd", "tau_ff")
    scaled_by = "command.kp"

    def torque(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """By the law of `measurement.command`."""
        return law_of(spec, joints).torque(run)

    def law(self, spec: MeasurementSpec, joints: tuple[str, ...]) -> DriveLaw:
        """That law."""
        return law_of(spec, joints)
