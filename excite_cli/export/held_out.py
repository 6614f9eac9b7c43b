"""What a model as it is exported leaves of the torque on held-out data.

From the traces that a fit or a diagnosis keeps of its held-out run: per joint the root of
Σ (τ − τ_model)² / Σ τ² over the samples that count, and the mean of that over the joints.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    file = _error(kept, _torques(robot, kept, _in_file(exported, holds)))
    if file is None:
        return None
    whole = _error(kept, [each.predicted for each in kept])
    before = None if described is None else _error(kept, _torques(robot, kept, described))
    name = kept[0].run
    return HeldOutErrors(name, file, whole or 0.0, before)


def torque_left(
    robot: Robot,
    traces: Sequence[TorqueTrace],
    exported: IdentifiedModel,
    holds: Callable[[Effect, Array], bool],
) -> Array:
    """RMS (n,) [N·m] of what the model as `exported` leaves of the held-out torque; NaN: unknown.

    `holds`: as for `held_out_errors`.
    """
    kept = [trace for trace in traces if trace.held_out]
    if not kept:
        return np.full(robot.n, np.nan)
    wrong, _, counts = _squares(kept, _torques(robot, kept, _in_file(exported, holds)))
    return np.where(counts >= FEWEST, np.sqrt(wrong / np.maximum(counts, 1)), np.nan)


def _in_file(exported: IdentifiedModel, holds: Callable[[Effect, Array], bool]) -> IdentifiedModel:
    lost = [
        effect
        for effect, values in exported.by_effect
        if effect.follows_covariate
        or not (effect.data_defect or effect.carried or holds(effect, values))
    ]
    return exported.without(tuple(lost))


def _torques(robot: Robot, traces: Sequence[TorqueTrace], model: IdentifiedModel) -> list[Array]:
    return [
        model.predicted(robot, Series(each.t, each.q, each.v, each.a, RunId(each.run))).torque
        for each in traces
    ]


def _squares(
    traces: Sequence[TorqueTrace], torques: Sequence[Array]
) -> tuple[Array, Array, NDArray[np.intp]]:
    """Sums (n,) of squares of what is left and of the torque, and how many samples count."""
    measured = np.concatenate([each.measured for each in traces])
    counted = np.concatenate([each.counted for each in traces]) & np.isfinite(measured)
    wrong = np.where(counted, measured - np.concatenate(torques), 0.0)
    size = np.where(counted, measured, 0.0)
    return np.square(wrong).sum(axis=0), np.square(size).sum(axis=0), counted.sum(axis=0)


def _error(traces: Sequence[TorqueTrace], torques: Sequence[Array]) -> float | None:
    """Mean over the joints with enough samples; None if there is none."""
    if not traces:
        return None
    wrong, size, counts = _squares(traces, torques)
    enough = (counts >= FEWEST) & (size > 0.0)
    if not enough.any():
        return None
    return float(np.sqrt(wrong[enough] / size[enough]).mean())
