"""What a model as it is exported leaves of the torque on held-out data.

From the traces that a fit or a diagnosis keeps of its held-out run: per joint the root of
Σ (τ − τ_model)² / Σ τ² over the samples that count, and the mean of that over the joints.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.identification.errors_of_torque import FEWEST
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.regression import Series
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class HeldOutErrors:
    """Shares of the torque RMS of `run`: of the file, the whole model, the robot as described.

    `described` is None where the URDF has no masses.
    """

    run: str
    file: float
    model: float
    described: float | None

    @property
    def worse(self) -> bool:
        """Whether the file is no better than the robot as described."""
        return self.described is not None and self.file >= self.described


def held_out_errors(
    robot: Robot,
    traces: Sequence[TorqueTrace],
    exported: IdentifiedModel,
    holds: Callable[[Effect, Array], bool],
    described: IdentifiedModel | None,
) -> HeldOutErrors | None:
    """Errors of the model as `exported` in a format that `holds` effects; None without such data.

    Of the other effects only defects of the measurement stay, but for those that follow a column.
    """
    kept = [trace for trace in traces if trace.held_out]
    lost = [
        effect
        for effect, values in exported.by_effect
        if effect.follows_covariate
        or not (effect.data_defect or effect.carried or holds(effect, values))
    ]
    known = exported.without(tuple(lost))

    def torques(model: IdentifiedModel) -> list[Array]:
        return [
            model.predicted(robot, Series(each.t, each.q, each.v, each.a, RunId(each.run))).torque
            for each in kept
        ]

    file = _error(kept, torques(known))
    if file is None:
        return None
    whole = _error(kept, [each.predicted for each in kept])
    before = None if described is None else _error(kept, torques(described))
    name = kept[0].run
    return HeldOutErrors(name, file, whole or 0.0, before)


def _error(traces: Sequence[TorqueTrace], torques: Sequence[Array]) -> float | None:
    """Mean over the joints with enough samples; None if there is none."""
    if not traces:
        return None
    measured = np.concatenate([each.measured for each in traces])
    counted = np.concatenate([each.counted for each in traces]) & np.isfinite(measured)
    wrong = np.where(counted, measured - np.concatenate(torques), 0.0)
    size = np.where(counted, measured, 0.0)
    enough = (counted.sum(axis=0) >= FEWEST) & size.any(axis=0)
    if not enough.any():
        return None
    shares = np.square(wrong).sum(axis=0)[enough] / np.square(size).sum(axis=0)[enough]
    return float(np.sqrt(shares).mean())
