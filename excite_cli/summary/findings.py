"""What was noticed about data, and every choice made between the file and the fit."""

from collections.abc import Sequence
from typing import Any

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.identification.stored_model import StoredFit
from excite_cli.shown.answer import Block, Fold, Table, Text

_WORDS = {
    "recorded_rate": "recorded rate [Hz]",
    "position_cutoff": "cut-off of the positions [Hz]",
    "parallel_cutoff": "cut-off of torque and columns [Hz]",
    "rate": "rate of the averaged samples [Hz]",
    "working_stride": "every so many recorded samples are worked on",
    "border": "cut off at both ends [s]",
    "velocity": "speeds are",
    "moving_speed": "a joint moves from [rad/s; m/s]",
    "bandwidth": "bandwidth of the speeds [Hz]",
    "reasons": "reasons",
    "samples": "samples used",
    "candidates": "candidates tried",
    "inflation": "null inflation of χ² (tests are corrected)",
    "runs": "training runs",
    "standstill_share": "samples left out at standstill and reversals",
    "invalid_share": "samples left out as invalid",
    "noise_orders": "order of the noise model",
    "noise_rms": "residual that counts as noise in tests, RMS [N·m; N]",
    "command": "command",
}
_SHARES = ("standstill_share", "invalid_share")


def data_blocks(
    found: Diagnosis | StoredFit, joint_names: Sequence[str], tables: Sequence[Table] = ()
) -> list[Block]:
    """What was noticed, warnings first; `tables`; every choice by its name; config, versions."""
    ranked = sorted(found.findings, key=lambda each: each.severity != "warning")
    noticed = (
        Text(
            f"{each.run}: {each.text}" if each.run and each.run not in each.text else each.text,
            "bad" if each.severity == "warning" else "plain",
        )
        for each in ranked
    )
    rows = tuple(
        (_WORDS.get(name, name.replace("_", " ")), _value(name, value, joint_names))
        for name, value in found.processing.items()
    )
    columns = ("choice", "value")
    return [
        *(noticed if ranked else [Text("Nothing was noticed about the data.", "good")]),
        *tables,
        Table("Processing of the data", columns, rows, left=columns, folded=True),
        Fold("Configuration", (Text(found.config, "code"),)),
        ", ".join(f"{name} {version}" for name, version in found.versions.items()),
    ]


def _value(name: str, value: Any, joint_names: Sequence[str]) -> str:
    if value is None:
        return "none"
    if isinstance(value, list | tuple):
        per_joint = len(value) == len(joint_names) and not any(isinstance(x, str) for x in value)
        told = [_number(name, x) for x in value]
        if per_joint:
            return ", ".join(f"{j} {x}" for j, x in zip(joint_names, told, strict=True))
        return "; ".join(told) or "none"
    return _number(name, value)


def _number(name: str, value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.1%}" if name in _SHARES else f"{value:.4g}"
    return str(value)
