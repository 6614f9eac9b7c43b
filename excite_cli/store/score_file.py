"""Scores as HDF5 (one JSON record), and thresholds of a collision detector as JSON."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from excite_cli.atomic import write_atomically, write_text_atomically
from excite_cli.errors import FileError
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.scoring.records import Score
from excite_cli.scoring.thresholds import Thresholds
from excite_cli.store import checked
from excite_cli.store.codec import as_json
from excite_cli.store.own_file import PROGRAM, OwnFile, is_marked, opened

SCHEMA = 1
CONTENT = "score"
OWN = OwnFile("a score", "Scores are written by `excite score`.", SCHEMA, ("content", CONTENT))


def write_score(path: Path, score: Score) -> None:
    """Write `score`; the file appears whole or not at all."""
    write_atomically(path, lambda temporary: _write(temporary, score))


def _write(path: Path, score: Score) -> None:
    with new_hdf5(path) as file:
        file.attrs.update({"program": PROGRAM, "content": CONTENT, "schema": SCHEMA})
        file["score"] = as_json(score)


def read_score(path: Path) -> Score:
    """Read a score.

    Raises
    ------
    FileError
        The file is missing, unreadable, not a score, damaged, or of a newer schema.
    """
    with opened(path, OWN) as file:
        found: Any = checked.record(file["score"][()], Score)
        joints = set(found.joint_names)
        if not all(set(run.error.relative) == joints for run in found.runs):
            raise ValueError("its runs are not of its joints")
        return found


def is_score(path: Path) -> bool:
    """Whether `path` is a file that `write_score` wrote."""
    return is_marked(path, OWN)


# Thresholds of a collision detector as JSON, written by us and read again.


class _Joint(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    c: tuple[float, float, float, float]
    level: float = Field(gt=0.0)


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    formula: str
    time_constant: float = Field(gt=0.0)
    false_alarms_per_hour: float = Field(gt=0.0)
    joints: dict[str, _Joint]


def write_thresholds(path: Path, thresholds: Thresholds) -> None:
    """Write them, with their formula."""
    write_text_atomically(path, json.dumps(thresholds.as_data(), indent=1) + "\n")


def read_thresholds(path: Path, joint_names: Sequence[str]) -> Thresholds:
    """Thresholds of these joints.

    Raises
    ------
    FileError
        The file is missing, is none of ours, or is about other joints.
    """
    try:
        found = _File.model_validate_json(path.read_bytes())
    except OSError as error:
        raise FileError(f"{path}: {error.strerror or error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "its text"
        raise FileError(
            f"{path} holds no thresholds: {where}: {first['msg']}. Make them with excite score "
            "MODEL RUNS --thresholds FILE.json."
        ) from error
    rows = [found.joints[name] for name in joint_names if name in found.joints]
    if len(rows) != len(joint_names) or len(found.joints) != len(rows):
        raise FileError(
            f"{path} holds thresholds of other joints ({', '.join(found.joints)}) than the model "
            f"({', '.join(joint_names)}). Make them with this model."
        )
    coefficients = np.array([row.c for row in rows])
    if (coefficients < 0.0).any() or not (coefficients[:, 0] > 0.0).all():
        raise FileError(f"{path}: c[0] must be above zero and the others not below.")
    return Thresholds(
        tuple(joint_names),
        coefficients,
        np.array([row.level for row in rows]),
        found.false_alarms_per_hour,
        found.time_constant,
    )
