"""A model that was identified once, and what was known of it then, as a frozen record."""

from dataclasses import dataclass
from pathlib import Path

from excite_cli.config.spec import Spec
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.processing import Processing
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Robot


@dataclass(frozen=True)
class StoredModel:
    """`model` of `robot` with what was known of it when it was made.

    `what` it is: "fit", "diagnosis", "config", or "urdf" for a config without numbers. `error` on
    `held_out_run`, which no fit saw; `noise` of the filtered torque by joint, where known;
    `processing`: the filters of both. `traces`: torque over time of training and held-out data.
    `consistent`: the same of bodies that can be, where a fit has them.
    """

    path: Path
    what: str
    spec: Spec
    folder: Path
    robot: Robot
    model: IdentifiedModel
    held_out_run: str = ""
    error: Errors | None = None
    noise: dict[str, float] | None = None
    processing: Processing | None = None
    traces: tuple[TorqueTrace, ...] = ()
    consistent: IdentifiedModel | None = None
    sources: tuple[str, ...] = ()
