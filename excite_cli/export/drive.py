"""The drive that a model was identified with: the law that was taken for the torque.

    τ_log = k_p (q* − q) + k_d (v* − v),    τ_log = (1 + g) τ + b

with g and b what the model holds for the gain and the offset of the measured torque. So the torque
at the joint is that of a drive with k_p / (1 + g), k_d / (1 + g), and −b / (1 + g) beside it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.effects.torque_gain import TorqueGain
from excite_cli.effects.torque_offset import TorqueOffset
from excite_cli.errors import ConfigError
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array


@dataclass(frozen=True)
class Drive:
    """Per joint (n,): `kp` [N·m/rad], `kd` [N·m·s/rad], `limit` and `bias` [N·m]; `delay` [s].

    Of sliding joints N/m, N·s/m and N; `limit` is infinite where there is none.
    """

    kp: Array
    kd: Array
    limit: Array
    bias: Array
    delay: float = 0.0

    def corrected(self, model: IdentifiedModel) -> "Drive":
        """The same with what `model` holds for gains and offsets of the law."""
        gain, offset = law_errors(model, len(self.kp))
        share = 1.0 / (1.0 + gain)
        return replace(
            self,
            kp=share * self.kp,
            kd=share * self.kd,
            limit=share * self.limit,
            bias=self.bias - share * offset,
        )


def law_errors(model: IdentifiedModel, count: int) -> tuple[Array, Array]:
    """Gain g and offset b [N·m] of the measured torque of every joint (count,)."""
    gain, offset = np.zeros(count), np.zeros(count)
    for effect, values in model.by_effect:
        if not effect.runs and isinstance(effect, TorqueGain):
            gain[list(effect.joints)] += values[0]
        elif not effect.runs and isinstance(effect, TorqueOffset):
            offset[list(effect.joints)] += values[0]
    return gain, offset


def drive_of(spec: Spec, joint_names: Sequence[str]) -> Drive | None:
    """The drive of `measurement.command`; None of robots whose torque is measured.

    Raises
    ------
    ConfigError
        It has no gain for a joint.
    """
    measurement: Any = spec.measurement
    if getattr(measurement, "torque", None) != "command":
        return None
    command = getattr(measurement, "command", None)
    kp, kd, limit = (_of_joints(command, name, joint_names) for name in ("kp", "kd", "limit"))
    unknown = [name for name, gain in zip(joint_names, kp, strict=True) if not gain > 0.0]
    if unknown:
        raise ConfigError(
            f"measurement.command.kp: no gain for {', '.join(unknown)}. Give it (N·m/rad), or "
            "export a fit or a diagnosis, which hold those that were found."
        )
    kd, limit = np.nan_to_num(kd, nan=0.0), np.where(np.isnan(limit), np.inf, limit)
    delay = _field(command, "delay")
    return Drive(kp, kd, limit, np.zeros(len(kp)), 0.0 if delay is None else float(delay))


def _field(command: Any, name: str) -> Any:
    if isinstance(command, Mapping):
        return command.get(name)
    return getattr(command, name, None)


def _of_joints(command: Any, name: str, joint_names: Sequence[str]) -> Array:
    """A number for all joints, or one by one; NaN where there is none (n,)."""
    given = _field(command, name)
    if isinstance(given, Mapping):
        return np.array([float(given.get(joint, np.nan)) for joint in joint_names])
    return np.full(len(joint_names), np.nan if given is None else float(given))
