"""Records go to HDF5 by their fields and come back to the last bit; what does not fit is named."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.fields import shape
from excite_cli.robot.model import Array
from excite_cli.store.codec import read_record, write_record


@dataclass(frozen=True)
class Inner:
    t: Annotated[Array, shape("m", finite=True)]
    x: Annotated[Array, shape("m", "n")]
    name: str = "inner"
    period: float | None = None


@dataclass(frozen=True)
class Outer:
    names: Annotated[tuple[str, ...], shape("n")]
    inner: Inner
    parts: tuple[Inner, ...]
    words: dict[str, float]
    last: Inner | None = None
    notes: tuple[str, ...] = ()
    more: dict[str, int] = field(default_factory=dict)


def inner(rows: int, columns: int, seed: int, single: bool) -> Inner:
    x = np.random.default_rng(seed).normal(size=(rows, columns))
    x = x.astype(np.float32).astype(float) if single else x
    return Inner(np.arange(rows) / 8.0, np.where(x > 2.0, np.nan, x), f"of {seed}", 0.5 * seed)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 4), st.lists(st.integers(0, 300), max_size=3), st.booleans())
def test_what_is_written_is_read_to_the_last_bit(n: int, rows: list[int], single: bool) -> None:
    parts = tuple(inner(m, n, k, single) for k, m in enumerate(rows))
    names = tuple(f"joint {k}" for k in range(n))
    record = Outer(names, inner(3, n, 9, single), parts, {"a": float("nan"), "b": 0.1})
    with h5py.File("x", "w", driver="core", backing_store=False) as file:
        write_record(file, record)
        found = read_record(file, Outer)
    assert (found.names, found.last, found.notes, found.more) == (names, None, (), {})
    assert np.isnan(found.words["a"])
    assert found.words["b"] == 0.1
    for one, other in zip((record.inner, *parts), (found.inner, *found.parts), strict=True):
        assert (one.name, one.period) == (other.name, other.period)
        assert np.array_equal(one.t, other.t)
        assert np.array_equal(one.x, other.x, equal_nan=True)


def without(name: str) -> Any:
    return lambda file: file.__delitem__(name)


def resized(file: h5py.File) -> None:
    values = file["parts/0/x"][:, 1:]
    del file["parts/0/x"]
    file["parts/0/x"] = values


def infinite(file: h5py.File) -> None:
    file["inner/t"][0] = np.inf


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (without("inner/x"), "it has no 'x'"),
        (without("records/words"), "it has no 'words'"),
        (resized, r"parts/0/x has the length 1 in place of 2 \(n\)"),
        (infinite, "not finite"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path: Path, spoil: Any, words: str) -> None:
    whole = inner(4, 2, 1, single=False)
    record = Outer(("a", "b"), whole, (whole, replace(whole, x=whole.x + 1.0)), {})
    with h5py.File(tmp_path / "x.h5", "w") as file:
        write_record(file, record)
        assert read_record(file, Outer).parts[1].period == 0.5
        spoil(file)
        with pytest.raises(ValueError, match=words):
            read_record(file, Outer)
