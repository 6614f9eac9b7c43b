"""Arrays and tables at hand in Python as columns with names, those of a CSV."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import ConfigError

Columns = dict[str, NDArray[np.float64]]


def names_of(names: Sequence[str], count: int) -> list[str]:
    """Those of so many recordings; ConfigError where they are not as many different ones."""
    found = [*names] or (["run"] if count == 1 else [f"run_{k + 1}" for k in range(count)])
    if isinstance(names, str) or not len({*found}) == len(found) == count > 0:
        raise ConfigError(f"names is {names!r}. Give each of {count} recordings one of its own.")
    return found


def tables_of(
    joints: Sequence[str], given: Mapping[str, Any], single: Collection[str]
) -> Iterator[Columns]:
    """Columns of every recording in arrays, or in lists of them; those `single` are (T,)."""
    if isinstance(joints, str) or len({*joints}) != len(joints):
        raise ConfigError(f"joint_names is {joints!r}. Give a list of different names.")
    several = isinstance(given["t"], list | tuple) and any(np.ndim(each) for each in given["t"])
    needed = {key: x for key, x in given.items() if x is not None or key in ("t", "q")}
    lists = {key: x if several else [x] for key, x in needed.items()}
    for key, x in lists.items():
        if not isinstance(x, list | tuple) or len(x) != len(lists["t"]):
            raise ConfigError(f"{key}: give a list of {len(lists['t'])} arrays, as t is one.")
    for k, t in enumerate(lists["t"]):
        count, found = len(np.atleast_1d(t)), Columns()
        for key, x in lists.items():
            values = np.asarray(x[k])
            wide = [(count, len(joints))] * (key not in ("t", *single))
            fits = wide + [(count,)] * (key not in ("q", "dq", "tau"))
            if values.shape not in fits or values.dtype.kind not in "biuf":
                raise ConfigError(
                    f"{key} has shape {values.shape} ({values.dtype}); expected numbers, "
                    f"{' or '.join(map(str, fits))}: {len(joints)} joints, a row per instant."
                )
            own = {f"{key}_{joint}": x for joint, x in zip(joints, values.T, strict=False)}
            found |= own if values.ndim == 2 else {key: values}
        yield found


def columns_in(frame: Any) -> tuple[Columns, list[str]]:
    """Columns (T,) of a table that hold numbers or dates (s from 1970), and names of others."""
    names = frame if isinstance(frame, Mapping) else getattr(frame, "columns", None)
    names = frame.column_names if hasattr(type(frame), "column_names") else names  # of Arrow
    if names is None:
        kind = type(frame).__name__
        raise ConfigError(
            f"frame is {kind}. Give a table with columns t, q_<joint>, tau_<joint>, …"
        )
    columns = {str(name): np.asarray(frame[name]) for name in names}
    shapes = {column.shape for column in columns.values()}
    if len(shapes) != 1 or min(map(len, shapes)) != 1 or max(shapes)[0] < 2:
        told = ", ".join(f"{name} {column.shape}" for name, column in columns.items())
        raise ConfigError(f"columns have shapes {told or '()'}. Give a value per instant in each.")
    found: Columns = {}
    for name, column in columns.items():
        if column.dtype.kind == "M":
            seconds = column.astype("datetime64[us]").astype(np.int64) / 1e6
            found[name] = np.where(np.isnat(column), np.nan, seconds)
        elif column.dtype.kind in "biuf":
            found[name] = column.astype(float)
    if not found:
        raise ConfigError(f"no column holds numbers: {', '.join(columns)}. Give t, q_<joint>, …")
    return found, [name for name in columns if name not in found]
