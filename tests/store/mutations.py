"""Every dataset and attribute of a file of ours, spoiled one at a time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np

Change = Callable[[Any], None]
_TEXTS = ("", "x", "{}", "[]", "null", "[1]", '{"x": 1}')


@dataclass(frozen=True)
class Mutation:
    """What is done to a copy of the file, and how it is called in a message."""

    name: str
    change: Change

    def apply(self, source: Path, target: Path) -> None:
        """Write the spoiled copy of `source` to `target`."""
        target.write_bytes(source.read_bytes())
        with h5py.File(target, "r+") as file:
            self.change(file)


def mutations(path: Path) -> Iterator[Mutation]:
    """All single changes of structure, type and values of the file."""
    places: list[str] = ["/"]
    with h5py.File(path, "r") as file:
        file.visit(places.append)
        for place in places:
            item = file[place]
            for key in item.attrs:
                yield from _of_attribute(place, key, item.attrs[key])
            if place != "/":
                yield Mutation(f"{place} deleted", partial(_delete, place))
            if isinstance(item, h5py.Dataset):
                yield from _of_dataset(place, item[()])


def _delete(place: str, file: Any) -> None:
    del file[place]


def _of_dataset(place: str, value: Any) -> Iterator[Mutation]:
    for name, other in _others(value):

        def change(file: Any, other: Any = other) -> None:
            kept = dict(file[place].attrs)
            del file[place]
            file[place] = other
            file[place].attrs.update(kept)

        yield Mutation(f"{place} {name}", change)


def _of_attribute(place: str, key: str, value: Any) -> Iterator[Mutation]:
    yield Mutation(f"{place}@{key} deleted", lambda file: file[place].attrs.__delitem__(key))
    for name, other in _others(value):

        def change(file: Any, other: Any = other) -> None:
            file[place].attrs[key] = other

        yield Mutation(f"{place}@{key} {name}", change)


def _others(value: Any) -> Iterator[tuple[str, Any]]:
    """Values of another shape, type or size, each with a name."""
    yield "a number", 7.5
    yield "a table", np.arange(6.0).reshape(2, 3)
    yield "an empty list", np.zeros(0)
    yield "a group's nothing", h5py.Empty("f8")
    if isinstance(value, str | bytes):
        yield from ((f"the text {text!r}", text) for text in _TEXTS)
        return
    array = np.asarray(value)
    yield "a text", "x"
    if array.dtype.kind in "OSU":
        words = [each.decode() if isinstance(each, bytes) else str(each) for each in array.ravel()]
        if words:
            yield "one text fewer", np.array(words[:-1], dtype=h5py.string_dtype())
            yield "other texts", np.array([f"{w}_x" for w in words], dtype=h5py.string_dtype())
            yield "texts turned round", np.array(words[::-1], dtype=h5py.string_dtype())
        return
    if array.dtype.kind not in "fiub":
        return
    if array.ndim == 0:
        yield from (("minus five", -5), ("huge", 1e300), ("NaN", np.nan), ("infinite", np.inf))
        yield "zero", 0
        return
    yield "one row fewer", array[:-1]
    yield "one axis more", array[None]
    yield "one long row", array.ravel()
    yield "NaN", np.full(array.shape, np.nan)
    yield "infinite", np.full(array.shape, np.inf)
    yield "zeros", np.zeros_like(array)
    yield "huge", np.full(array.shape, 1e300)
    yield "minus five", np.full(array.shape, -5)
    if array.ndim == 2:
        yield "one column fewer", array[:, :-1]
        yield "one row and column fewer", array[:-1, :-1]
        yield "transposed", array.T
