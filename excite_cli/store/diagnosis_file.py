"""Diagnoses as HDF5: arrays as datasets, records as JSON texts under `/records`.

Reading trusts nothing: a foreign or damaged file gives one message.
"""

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.atomic import write_atomically
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import (
    Absorbed,
    Approximation,
    Assumption,
    Diagnosis,
    EffectRecord,
    FrictionLine,
    HeldOutEnds,
    Information,
    JointAlias,
    LargeRest,
    NamedEffect,
    Round,
    Textbook,
)
from excite_cli.diagnosis.words import approximation_in_words
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.measurement.campaign_clock import Recorded
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.robot.tree import Skeleton
from excite_cli.store import checked
from excite_cli.store.own_file import PROGRAM, OwnFile, is_marked, opened
from excite_cli.store.trace_groups import (
    read_torque_traces,
    read_traces,
    require_joints,
    write_torque_traces,
    write_traces,
)

# What an effect only comes near, as files have it.


def approximation_as_data(found: Approximation | None) -> dict[str, Any]:
    """Entries of an effect's record: a text for people, and itself."""
    if found is None:
        return {"approximates": ""}
    codes = [covariate.code for covariate in found.covariates]
    return {
        "approximates": approximation_in_words(found),
        "approximation": {"covariates": codes, "kind": found.kind},
    }


def approximation_of(data: Mapping[str, Any]) -> Approximation | None:
    """The approximation in an effect's record, if it is one.

    Raises
    ------
    ValueError
        Nothing that a residual may depend on.
    """
    given = data.get("approximation")
    if given is None:
        return None
    covariates = tuple(Covariate.of_code(str(code)) for code in given["covariates"])
    return Approximation(covariates, str(given["kind"]))


SCHEMA = 2  # since 0.3, which says held-out for sealed
CONTENT = "diagnosis"
OWN = OwnFile(
    "a diagnosis",
    "Diagnoses are written by `excite diagnose`.",
    SCHEMA,
    ("content", CONTENT),
    oldest=2,
)
_ATTRIBUTES = ("config", "config_folder", "held_out_run")
_OF_BASE = ("base_values", "base_std")
_RECORDS: dict[str, Any] = {
    "joint_names": tuple[str, ...],
    "base_names": tuple[str, ...],
    "declared": tuple[EffectRecord, ...],
    "effects": tuple[NamedEffect, ...],
    "absorbed": tuple[Absorbed, ...],
    "before": Errors,
    "after": Errors,
    "rounds": tuple[Round, ...],
    "findings": tuple[Finding, ...],
    "processing": dict[str, Any],
    "versions": dict[str, str],
}
# Records that files of earlier versions lack.
_LATER: dict[str, Any] = {
    "noise_floor": dict[str, float] | None,
    "assumed": tuple[Assumption, ...],
    "parts": tuple[HeldOutEnds, ...],
    "untouched": Errors | None,
    "textbook": Textbook | None,
    "large_rests": tuple[LargeRest, ...],
    "joint_aliases": tuple[JointAlias, ...],
    "friction_lines": tuple[FrictionLine, ...],
    "inertia_parts": dict[str, float],
    "inertia_names": tuple[str, ...],
    "trained": Errors | None,
    "skeleton": Skeleton | None,
    "recorded": Recorded,
}
_INFORMATION: dict[str, Any] = {
    "model": tuple[EffectRecord, ...],
    "rivals": tuple[EffectRecord, ...],
}


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write `diagnosis`; the file appears whole or not at all."""
    write_atomically(path, lambda temporary: _write(temporary, diagnosis))


def read_diagnosis(path: Path) -> Diagnosis:
    """Read a diagnosis.

    Raises
    ------
    FileError
        The file is missing, unreadable, not a diagnosis, damaged, or of a newer schema.
    """
    with opened(path, OWN) as file:
        return _read(file, path)


def is_diagnosis(path: Path) -> bool:
    """Whether `path` is a file that `write_diagnosis` wrote."""
    return is_marked(path, OWN)


def _write(path: Path, diagnosis: Diagnosis) -> None:
    information = diagnosis.information
    with new_hdf5(path) as file:
        file.attrs.update(
            {
                "program": PROGRAM,
                "content": CONTENT,
                "schema": SCHEMA,
                "robot_hash": diagnosis.fingerprint,
                "seconds": diagnosis.seconds,
                "units": "rad, s, N·m, kg, m",
                **{name: getattr(diagnosis, name) for name in _ATTRIBUTES},
            }
        )
        for name in (*_RECORDS, *_LATER):
            file[f"records/{name}"] = _text(getattr(diagnosis, name))
        for name in ("phi", *_OF_BASE):
            file[name] = np.asarray(getattr(diagnosis, name), dtype=float)
        for name in _INFORMATION:
            file[f"information/{name}"] = _text(getattr(information, name))
        file["information/factor"] = np.asarray(information.factor, dtype=float)
        file["information/noise"] = np.asarray(information.noise, dtype=float)
        file["information"].attrs["rank"] = int(information.rank)
        if diagnosis.traces is not None:
            write_traces(file.create_group("traces"), diagnosis.traces)
        write_torque_traces(file.create_group("held_out_traces"), diagnosis.held_out_traces)


def _read(file: Any, path: Path) -> Diagnosis:
    attributes = file.attrs
    fields: dict[str, Any] = {name: checked.text(attributes, name) for name in _ATTRIBUTES}
    checked.stored_spec(fields["config"], str(path))
    fields.update({name: _record(file, f"records/{name}", _RECORDS[name]) for name in _RECORDS})
    joints = checked.names(fields["joint_names"], "joint_names")
    base = (len(fields["base_names"]),)
    fields["phi"] = checked.array(file["phi"], (None,))
    fields.update({name: checked.array(file[name], base, finite=False) for name in _OF_BASE})
    for name, kind in _LATER.items():
        if f"records/{name}" in file:
            fields[name] = _record(file, f"records/{name}", kind)
    # Files of earlier versions have no traces.
    fields["traces"] = read_traces(file["traces"], joints) if "traces" in file else None
    if "held_out_traces" in file:
        fields["held_out_traces"] = read_torque_traces(file["held_out_traces"], len(joints))
    found = Diagnosis(
        fingerprint=checked.text(attributes, "robot_hash"),
        seconds=checked.number(attributes, "seconds"),
        information=_information(file["information"], len(joints)),
        **fields,
    )
    ends = [error for part in found.parts for error in (part.before, part.after)]
    others = [found.untouched, found.textbook and found.textbook.error]
    known = (found.before, found.after, *ends, *(each for each in others if each))
    require_joints(joints, known, found.noise_floor)
    if found.skeleton is not None and not found.skeleton.fits(len(joints)):
        raise ValueError("its skeleton is that of another robot")
    if not _named_joints(found) <= set(joints):
        raise ValueError("it names joints that are not its own")
    return found


def _information(group: Any, joints: int) -> Information:
    factor = checked.array(group["factor"], (None, None))
    rank = checked.count(group.attrs, "rank")
    if rank > factor.shape[1]:
        raise ValueError("its information has fewer columns than base parameters")
    return Information(
        factor=factor,
        rank=rank,
        noise=checked.array(group["noise"], (joints,)),
        **{name: _record(group, name, kind) for name, kind in _INFORMATION.items()},
    )


def _named_joints(found: Diagnosis) -> set[str]:
    """All that its records name."""
    records: list[EffectRecord | Absorbed] = [
        *found.declared,
        *found.information.model,
        *found.information.rivals,
        *(found.textbook.effects if found.textbook else ()),
        *(each.effect for each in found.effects),
        *(effect for part in found.parts for effect in part.effects),
        *(alias for each in found.effects for alias in each.aliases),
        *(one for each in found.joint_aliases for one in (*each.named, *each.others)),
        *(suspect.effect for each in found.rounds for suspect in each.suspects),
        *found.absorbed,
    ]
    return {
        *(joint for each in records for joint in each.joints),
        *(joint for each in found.effects for joint in (*each.removes, *each.parts)),
        *found.inertia_parts,
        *(each.joint for each in found.large_rests),
        *(each.joint for each in found.friction_lines),
        *(joint for each in found.rounds for joint in each.residual),
    }


def _text(value: Any) -> str:
    """JSON of a record; numbers of NumPy become plain ones, NaN stays NaN."""
    return json.dumps(_plain(value), ensure_ascii=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Covariate):
        return value.code
    if isinstance(value, NamedEffect):
        known = {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
        return {**known, **approximation_as_data(value.approximates)}
    if hasattr(value, "__dataclass_fields__"):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value


def _record(group: Any, name: str, kind: Any) -> Any:
    return checked.record(group[name][()], kind, partial(_known, name))


def _known(name: str, value: Any) -> Any:
    """What stands in the file as a text, as a record."""
    if name == "records/large_rests":
        return [
            {**each, "depends_on": tuple(map(Covariate.of_code, each["depends_on"]))}
            for each in value
        ]
    if name == "records/effects":
        return [
            {
                **{key: item for key, item in each.items() if key != "approximation"},
                "approximates": approximation_of(each),
            }
            for each in value
        ]
    return value
