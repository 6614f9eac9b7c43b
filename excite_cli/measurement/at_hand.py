"""Arrays and tables at hand in Python as named columns, those of a CSV."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import ConfigError

Array = NDArray[np.float64]


def refuse_twice(what: str, names: Sequence[str]) -> None:
    """Raise ConfigError where `what` names something twice."""
    twice = [name for k, name in enumerate(names) if name in names[:k]]
    if twice:
        raise ConfigError(f"{what}: '{twice[0]}' is there twice. Give each its own name.")


def columns_of(
    arrays: Mapping[str, Any], joints: tuple[str, ...], single: Sequence[str]
) -> dict[str, Array]:
    """Columns (T,) of one recording: those `single` have one, q, tau and dq one for each joint."""
    n, found = len(joints), {}
    count = len(arrays["t"]) if np.ndim(arrays["t"]) else 0
    for key, values in arrays.items():
        x = _numbers(key, values)
        matrix = x[:, None] if x.ndim == 1 and n == 1 and key in ("q", "tau", "dq") else x
        flat, wide = [(count,)], [(count, n)]
        allowed = flat if key in ("t", *single) else wide if key in ("q", "tau", "dq") else None
        if matrix.shape not in (allowed or [*flat, *wide]):
            shapes = " or ".join(map(str, allowed or [*flat, *wide]))
            turned = " It looks transposed." if x.T.shape in wide and n != count else ""
            raise ConfigError(
                f"{key} has shape {x.shape}; expected {shapes}: a row for each of the {count} "
                f"instants of t{'' if key == 't' else f', joints {n}'}.{turned}"
            )
        if matrix.ndim == 1:
            found[key] = matrix
        else:
            found |= {f"{key}_{joint}": matrix[:, j] for j, joint in enumerate(joints)}
    return found


def _numbers(key: str, values: Any) -> Array:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{key} does not hold numbers: {error}. Give an array.") from error


def columns_in(frame: Any) -> tuple[dict[str, Array], list[str]]:
    """Columns (T,) of a table that hold numbers or dates (s from 1970), and names of others."""
    listed = getattr(frame, "column_names", None)
    listed = getattr(frame, "columns", None) if listed is None else listed
    if listed is None and not isinstance(frame, Mapping):
        raise ConfigError(
            f"frame is {type(frame).__name__}. Give a table with columns by name: t, q_<joint>, …, "
            "tau_<joint>, …"
        )
    found: dict[str, Array] = {}
    words: list[str] = []
    count = None
    for name in frame if listed is None else listed:
        column = np.asarray(frame[name])
        count = column.shape[:1] if count is None else count
        if column.shape != count or not count:
            raise ConfigError(
                f"column '{name}' has shape {column.shape}; expected {count or '(T,)'} as the "
                "first one. Give a value per instant in each."
            )
        if column.dtype.kind == "M":
            seconds = column.astype("datetime64[us]").astype(np.int64) / 1e6
            found[str(name)] = np.where(np.isnat(column), np.nan, seconds)
            continue
        try:
            found[str(name)] = column.astype(float)
        except (TypeError, ValueError):
            words.append(str(name))
    return found, words
