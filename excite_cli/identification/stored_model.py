"""A model that was identified once, and what was known of it then, as a frozen record."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from excite_cli.config.spec import Spec
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.processing import Processing
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.measurement.campaign_clock import Recorded
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.answer import Shown

# What a fit file holds, as a frozen record.


@dataclass(frozen=True, repr=False)
class StoredFit(Shown):
    """A fit with its errors and what was noticed.

    `closed_loop_bias` is a sentence, `torque_units` per joint, `traces` torque over time,
    `recorded` when.
    """

    config: str
    config_folder: str
    fingerprint: str
    fit: Fit
    held_out_run: str
    error: Errors
    training_error: Errors
    findings: tuple[Finding, ...]
    sources: tuple[str, ...]
    noise_floor: dict[str, float] | None = None
    closed_loop_bias: str = ""
    processing: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    torque_units: tuple[str, ...] = ()
    traces: tuple[TorqueTrace, ...] = ()
    recorded: Recorded = field(default_factory=Recorded)


@dataclass(frozen=True)
class StoredModel:
    """`model` of `robot` with what was known of it when it was made.

    `what` it is: "fit", "diagnosis", "config", or "urdf" for a config without numbers. `error` on
    `held_out_run`, which no fit saw; `noise` of the filtered torque by joint, where known;
    `processing`: the filters of both. `traces`: torque over time of training and held-out data.
    `consistent`: the same of bodies that can be, where a fit has them. `factor` R (r + k, r + k):
    RᵀR is the information of the r base parameters and of the effects' k, in their order.
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
    factor: Array | None = None
    sources: tuple[str, ...] = ()
