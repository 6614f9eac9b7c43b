"""Answers do not depend on where large arrays lie."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

import excite_cli.out_of_core
from excite_cli import diagnose, identify, load_data
from tests.api.conftest import Loop


def same(one: Any, other: Any) -> bool:
    """Whether two records hold the same to the last bit."""
    if is_dataclass(one) and not isinstance(one, type):
        names = [each.name for each in fields(one) if each.name not in {"seconds"}]
        return all(same(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return one is other or one == other or one != one


@pytest.mark.parametrize("task", [identify, diagnose])
def test_answers_do_not_depend_on_where_arrays_lie(
    task: Any, loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every array on disk, against every array in memory."""
    at_hand = task(loop.problem, load_data(loop.problem, loop.data))
    monkeypatch.setattr(excite_cli.out_of_core, "ROOM", 0)
    on_disk = task(loop.problem, load_data(loop.problem, loop.data))
    assert same(at_hand, on_disk)
