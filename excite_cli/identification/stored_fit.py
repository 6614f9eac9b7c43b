"""What a fit file holds, as a frozen record."""

from dataclasses import dataclass, field
from typing import Any

from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.recorded import Recorded
from excite_cli.shown.record import Shown


@dataclass(frozen=True, repr=False)
class StoredFit(Shown):
    """A fit with its errors and what was noticed.

    `closed_loop_bias` is a sentence, `torque_units` per joint, `traces` torque over time,
    `recorded` when; files of earlier versions have none of them.
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
