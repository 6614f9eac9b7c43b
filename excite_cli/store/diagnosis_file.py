"""Diagnoses as HDF5, field by field. Reading trusts nothing: a damaged file gives one message."""

from pathlib import Path
from typing import Any

from excite_cli.atomic import write_atomically
from excite_cli.diagnosis.records import ConfoundedCandidate, Diagnosis, EffectRecord
from excite_cli.diagnosis.traces import Traces
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.store import checked
from excite_cli.store.codec import read_record, write_record
from excite_cli.store.own_file import PROGRAM, OwnFile, is_marked, opened

SCHEMA = 2  # since 0.3, which says held-out for sealed
CONTENT = "diagnosis"
OWN = OwnFile(
    "a diagnosis",
    "Diagnoses are written by `excite diagnose`.",
    SCHEMA,
    ("content", CONTENT),
    oldest=2,
)


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
    with new_hdf5(path) as file:
        file.attrs.update({"program": PROGRAM, "content": CONTENT, "schema": SCHEMA})
        file.attrs["units"] = "rad, s, N·m, kg, m"
        write_record(file, diagnosis)


def _read(file: Any, path: Path) -> Diagnosis:
    found = read_record(file, Diagnosis)
    checked.stored_spec(found.config, str(path))
    joints = checked.names(found.joint_names, "joint_names")
    if found.information.rank > found.information.factor.shape[1]:
        raise ValueError("its information has fewer columns than base parameters")
    ends = [error for part in found.parts for error in (part.before, part.after)]
    others = [found.untouched, found.trained, found.textbook and found.textbook.error]
    known = (found.before, found.after, *ends, *(each for each in others if each))
    checked.require_joints(joints, known, found.noise_floor)
    if found.skeleton is not None and not found.skeleton.fits(len(joints)):
        raise ValueError("its skeleton is that of another robot")
    traced = set[str]() if found.traces is None else _traced_joints(found.traces)
    if not _named_joints(found) | traced <= set(joints):
        raise ValueError("it names joints that are not its own")
    return found


def _traced_joints(traces: Traces) -> set[str]:
    named = {joint for each in traces.effects for joint in (*each.joints, *each.rows)}
    return named | {*traces.dependence.joints}


def _named_joints(found: Diagnosis) -> set[str]:
    """All that its records name."""
    records: list[EffectRecord | ConfoundedCandidate] = [
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
        *(each.joint for each in found.excess_residuals),
        *(each.joint for each in found.friction_lines),
        *(joint for each in found.rounds for joint in each.residual),
    }
