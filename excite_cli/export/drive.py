"""The drive that a model was identified with: the law that was taken for the torque.

    τ_log = k_p (q* − q) + k_d (v* − v),    τ_log = (1 + g) τ + b

with g and b what the model holds for the gain and the offset of the measured torque. So the torque
at the joint is that of a drive with k_p / (1 + g), k_d / (1 + g), and −b / (1 + g) beside it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.measurement.torque_sources.command import Command, law_of
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
        if not effect.runs and effect.kind == "torque_gain":
            gain[list(effect.joints)] += values[0]
        elif not effect.runs and effect.kind == "torque_offset":
            offset[list(effect.joints)] += values[0]
    return gain, offset


def drive_of(spec: Spec, joint_names: Sequence[str]) -> Drive | None:
    """The drive of `measurement.command`; None of robots whose torque is measured.

    Raises
    ------
    ConfigError
        It has no gain.
    """
    measurement = spec.measurement
    if measurement.torque != Command.name:
        return None
    if measurement.command.kp is None:
        raise ConfigError(
            "measurement.command.kp: no gain is given. Give it [N·m/rad], or export a fit or a "
            "diagnosis, which hold those that were found."
        )
    law = law_of(measurement, tuple(joint_names))
    return Drive(law.kp, law.kd, law.limit, np.zeros(len(law.kp)), law.delay)
