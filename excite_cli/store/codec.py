"""Records to HDF5 and back, by their fields: arrays stay arrays, all else can be read as text.

In the group of a record its field f is

* an array or a tuple of texts: the dataset f,
* one number or text: the attribute f,
* a record that holds arrays: the group f; a tuple of such records: the groups f/0, f/1 …,
* anything else: the JSON text records/f.

What is None is not written. A field that is missing takes its default; None where it may be that.
Arrays are kept in single precision where that changes no bit of them, and have the shapes that
stand at the fields (`fields.Shape`).
"""

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import h5py
import numpy as np

from excite_cli.fields import Shape, data_of
from excite_cli.store import checked

Record = TypeVar("Record")
Lengths = dict[str, int]
_SCALARS = (str, int, float, bool)
_WORTH_PACKING = 256  # numbers: of fewer the description takes more than is won


def write_record(group: Any, record: Any, without: Collection[str] = ()) -> None:
    """Write all fields of `record` but some into an empty group."""
    kinds = _kinds(type(record))
    for name in (each.name for each in fields(record) if each.name not in without):
        value, kind = getattr(record, name), kinds[name]
        if value is None:
            continue
        if isinstance(value, np.ndarray):
            _write_array(group, name, value)
        elif _is_texts(kind):
            group[name] = np.array(list(value), dtype=h5py.string_dtype())
        elif isinstance(value, _SCALARS):
            group.attrs[name] = value
        elif not _holds_arrays(kind):
            group[f"records/{name}"] = as_json(value)
        elif isinstance(value, tuple):
            numbered = group.create_group(name)
            for number, each in enumerate(value):
                write_record(numbered.create_group(str(number)), each)
        else:
            write_record(group.create_group(name), value)


def read_record(
    group: Any, kind: type[Record], known: Mapping[str, Any] | None = None, **lengths: int
) -> Record:
    """The record of `kind` in a group; `known` fields are not read, `lengths` are of symbols.

    Raises
    ------
    ValueError
        A field is missing, or is not of its kind or shape.
    """
    return _read(group, kind, dict(known or {}), lengths)


def _read(group: Any, kind: type[Record], found: dict[str, Any], lengths: Lengths) -> Record:
    kinds = _kinds(kind)
    for field in fields(kind):  # type: ignore[arg-type]
        if field.name not in found:
            if _is_there(group, field.name):
                found[field.name] = _field(group, field.name, kinds[field.name], lengths)
            elif NoneType in get_args(kinds[field.name]):
                found[field.name] = None
            elif _is_needed(field):
                raise ValueError(f"it has no '{field.name}'")
    return kind(**found)


def _field(group: Any, name: str, kind: Any, lengths: Lengths) -> Any:
    kind, form = _bare(kind)
    if _is_array(kind):
        return _array(group[name], kind, form, lengths)
    if _is_texts(kind):
        texts = checked.texts(group[name][()], f"'{name}'")
        _bind(name, (len(texts),), form, lengths)
        return texts
    if isinstance(kind, type) and issubclass(kind, _SCALARS):
        return _scalar(group.attrs, name, kind)
    if not _holds_arrays(kind):
        return checked.record(group[f"records/{name}"][()], kind)
    if get_origin(kind) is tuple:
        (each, _) = get_args(kind)
        own = group[name]
        return tuple(_read(own[str(k)], each, {}, dict(lengths)) for k in range(len(own)))
    return _read(group[name], kind, {}, dict(lengths))


def as_json(value: Any) -> str:
    """JSON of a record; numbers of NumPy become plain ones, NaN stays NaN."""
    return json.dumps(data_of(value), ensure_ascii=False)


def _write_array(group: Any, name: str, array: Any) -> None:
    if array.dtype.kind == "f":
        with np.errstate(over="ignore"):
            single = array.astype(np.float32)
        array = single if np.array_equal(single, array, equal_nan=True) else array
    packed = {"compression": "gzip", "shuffle": True} if array.size > _WORTH_PACKING else {}
    group.create_dataset(name, data=array, **packed)


def _array(dataset: Any, kind: Any, form: Shape | None, lengths: Lengths) -> Any:
    sizes = (None,) * np.ndim(dataset) if form is None else (None,) * len(form.lengths)
    if get_args(get_args(kind)[1])[0] is np.bool_:
        found: Any = checked.flags(dataset, sizes)
    else:
        found = checked.array(dataset, sizes, finite=form is not None and form.finite)
    _bind(dataset.name, found.shape, form, lengths)
    return found


def _bind(name: str, sizes: tuple[int, ...], form: Shape | None, lengths: Lengths) -> None:
    """Remember lengths by their symbols, or see that they are as before."""
    for symbol, size in zip(form.lengths if form else (), sizes, strict=False):
        if lengths.setdefault(symbol, size) != size:
            raise ValueError(
                f"{name} has the length {size} in place of {lengths[symbol]} ({symbol})"
            )


def _scalar(attributes: Any, name: str, kind: type) -> Any:
    if issubclass(kind, str):
        return kind(checked.text(attributes, name))
    if issubclass(kind, bool):
        return checked.flag(attributes, name)
    return (checked.count if issubclass(kind, int) else checked.number)(attributes, name)


def _is_there(group: Any, name: str) -> bool:
    return name in group or name in group.attrs or f"records/{name}" in group


def _is_needed(field: "Field[Any]") -> bool:
    return field.default is MISSING and field.default_factory is MISSING


def _hints(record: Any) -> dict[str, Any]:
    return get_type_hints(record, include_extras=True)


_kinds: Callable[[Any], dict[str, Any]] = cache(_hints)


def _bare(kind: Any) -> tuple[Any, Shape | None]:
    """Without `| None` and what is annotated, and the shape."""
    if get_origin(kind) in (Union, UnionType):
        some = [each for each in get_args(kind) if each is not NoneType]
        return _bare(some[0]) if len(some) == 1 else (kind, None)
    if get_origin(kind) is Annotated:
        inner, *notes = get_args(kind)
        return _bare(inner)[0], next((each for each in notes if isinstance(each, Shape)), None)
    return kind, None


def _is_array(kind: Any) -> bool:
    return get_origin(_bare(kind)[0]) is np.ndarray


def _is_texts(kind: Any) -> bool:
    return bool(_bare(kind)[0] == tuple[str, ...])


@cache
def _holds_arrays(kind: Any) -> bool:
    """Whether it is a record with arrays in it, or a tuple of such."""
    kind, _ = _bare(kind)
    if get_origin(kind) is tuple:
        return any(_holds_arrays(each) for each in get_args(kind) if each is not Ellipsis)
    if not (isinstance(kind, type) and is_dataclass(kind)):
        return False
    return any(_is_array(each) or _holds_arrays(each) for each in _kinds(kind).values())
