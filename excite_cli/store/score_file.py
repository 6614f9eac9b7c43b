"""Scores as HDF5: one JSON record."""

from pathlib import Path
from typing import Any

from excite_cli.atomic import write_atomically
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.scoring.records import Score
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
