"""Friction that changes over a campaign, as a robot warms up: τ_j = φ(t) (Δc sgn v_j + Δb v_j).

t is the campaign's time at the start of a recording, from the start of the first one, and φ grows
from 0 to 1 within the campaign's span S, towards an end with time constant T:

    φ(t) = (1 − e^(−t/T)) / (1 − e^(−S/T)),   for T ≫ S   φ(t) = t/S.

So Δc and Δb are by how much friction is larger at the end than at the start, and Coulomb and
viscous friction beside it are those of the start. A recording that took no part in the fit has its
own place on the clock. Within a recording it stays: what warms up there is `friction_drift`, and
where files have no stamps, the pauses between them are not known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array, Robot

# Of the span; the last is a straight line. Steps of single runs explain what a coarse grid leaves.
_TIME_CONSTANTS = (0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 1.0, 20.0)
_OVER = 0.9  # of the change, by the second recording: a step
_FEWEST = 3  # recordings: two differ by a step as well as by a trend


class FrictionChange(Effect):
    """τ_j = φ(t) (coulomb_change · sgn v_j + viscous_change · v_j), of either sign."""

    kind: ClassVar = "friction_change"
    title: ClassVar = "friction that changes over the campaign"
    signature: ClassVar = "friction is not the same in later recordings as in earlier ones"
    function_of: ClassVar = ("speed", "time")
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("coulomb_change", "N·m", 0.02, 100.0),
        Parameter("viscous_change", "N·m·s/rad", 0.02, 100.0),
    )
    shapes: ClassVar = (
        Parameter("time_constant", "s", 1.0, 1e7),
        Parameter("span", "s", 1.0, 1e7),
    )
    defaults: ClassVar[Mapping[str, float]] = {"time_constant": 20.0, "span": 60.0}
    of_campaign: ClassVar = True
    excitable: ClassVar = False
    why_not_excitable: ClassVar = "it shows between recordings; a motion lasts too short"
    refines: ClassVar = ("coulomb_friction", "viscous_friction")
    changes_of: ClassVar = refines

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """From a quick start to a straight line; nothing where recordings are too few.

        What is over before the second recording is a step of the first one's friction.
        """
        if len({seen.run.name for seen in signals}) < _FEWEST:
            return []
        starts = sorted({seen.start for seen in signals})
        span = starts[-1]
        shapes = [{"time_constant": share * span, "span": span} for share in _TIME_CONSTANTS]
        second = [cls(joints, shape).progress(starts[1]) for shape in shapes]
        return [shape for shape, there in zip(shapes, second, strict=True) if there < _OVER]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """The span is no choice; no step becomes a step of the first recording's friction."""
        if name == "span":
            return ()
        second = sorted({seen.start for seen in signals})[1:2]
        return [
            step
            for step in super().finer_steps(name, signals)
            if not second or self._quicker(step).progress(second[0]) < _OVER
        ]

    def _quicker(self, step: float) -> "FrictionChange":
        """The same with a time constant that is smaller by `step`."""
        constant = self.shape["time_constant"] - step
        return replace(self, shape={**self.shape, "time_constant": constant})

    def progress(self, start: float) -> float:
        """φ at a time on the campaign's clock [s]."""
        constant, span = self.shape["time_constant"], self.shape["span"]
        return float(np.expm1(-start / constant) / np.expm1(-span / constant))

    def columns(self, signals: Signals) -> Array:
        """φ sgn v_j and φ v_j, (T, 1, 2)."""
        v = signals.v[:, self.joints[0]]
        return (self.progress(signals.start) * np.stack([smooth_sign(v), v], axis=-1))[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """φ(start) (c sgn v_j + b v_j)."""
        j, (c, b) = self.joints[0], map(real, values)
        constant, whole = self.shape["time_constant"], -self.shape["span"]
        progress = f"expm1(-start / {real(constant)}) / {real(np.expm1(whole / constant))}"
        return f"tau[{j}] += {progress} * ({c} * s[{j}] + {b} * v[{j}]);"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = φ (w_c · slope of the sign + w_v)."""
        j, w = self.joints[0], self.progress(signals.start) * weights[:, 0]
        slope = smooth_sign_slope(signals.v[:, j])
        return Cotangents(v=signals.only(j, w[:, 0] * slope + w[:, 1]))

    def abscissa(self, signals: Signals) -> Abscissa:
        """The campaign's time with the sign of the speed."""
        sign = smooth_sign(signals.v[:, self.joints[0]])
        return Abscissa("campaign time, signed by the direction", "s", signals.clock * sign)
