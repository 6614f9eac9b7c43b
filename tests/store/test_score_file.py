"""Thresholds come back from their file as they were; what is none of ours is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.scoring.thresholds import Thresholds
from excite_cli.store.score_file import read_thresholds, write_thresholds

GIVEN = Thresholds(("a", "b"), np.arange(1.0, 9.0).reshape(2, 4), np.array([3.0, 4.0]), 0.5, 0.02)


def test_they_come_back(tmp_path: Path) -> None:
    path = tmp_path / "limits.json"
    write_thresholds(path, GIVEN)
    found = read_thresholds(path, ("b", "a"))
    assert found.joint_names == ("b", "a")
    assert np.array_equal(found.coefficients, GIVEN.coefficients[::-1])
    assert np.array_equal(found.level, [4.0, 3.0])
    assert (found.false_alarms, found.time_constant) == (0.5, 0.02)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"joints": {"a": {"c": [1, 0, 0, 0], "level": 3}}}, "of other joints"),
        ({"time_constant": 0.0}, "time_constant: Input should be greater than 0"),
        ({"time_constant": "1e999"}, "time_constant"),
        ({"joints": {n: {"c": [0, 1, 1, 1], "level": 3} for n in "ab"}}, "above zero"),
        ({"joints": {n: {"c": [1, 1, 1], "level": 3} for n in "ab"}}, "joints.a.c"),
    ],
)
def test_what_is_none_of_ours_is_refused(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    path = tmp_path / "limits.json"
    path.write_text(json.dumps({**GIVEN.as_data(), **change}))
    with pytest.raises(FileError, match=words):
        read_thresholds(path, ("a", "b"))


def test_a_file_that_is_no_json(tmp_path: Path) -> None:
    path = tmp_path / "limits.json"
    path.write_text("level: 3")
    with pytest.raises(FileError, match="holds no thresholds: its text"):
        read_thresholds(path, ("a", "b"))
    with pytest.raises(FileError, match="No such file"):
        read_thresholds(tmp_path / "none.json", ("a", "b"))
