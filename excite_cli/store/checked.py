"""Reading the parts of a file of ours: of the kind and shape that they must have, or refused.

Whatever does not fit raises a ValueError that names the part; `opened` makes one message of it.
"""

import json
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.robot.model import Array

Shape = tuple[int | None, ...]
_BEYOND = 1e100  # whatever is squared stays finite


def text(attributes: Any, name: str, default: str | None = None) -> str:
    """An attribute that is one text."""
    value = attributes[name] if default is None else attributes.get(name, default)
    if not isinstance(value, str):
        raise ValueError(f"attribute '{name}' is not text")
    return value


def texts(value: Any, what: str) -> tuple[str, ...]:
    """A list of texts, of an attribute or a dataset; h5py stores an empty one as numbers."""
    array = np.asarray(value)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "OSU"):
        raise ValueError(f"{what} is not a list of texts")
    return tuple(x.decode() if isinstance(x, bytes) else _word(x, what) for x in array.tolist())


def names(value: Any, what: str) -> tuple[str, ...]:
    """A list of texts that is not empty and has none twice."""
    found = texts(value, what)
    if not found or len(set(found)) != len(found):
        raise ValueError(f"{what} is empty, or has a name twice")
    return found


def number(attributes: Any, name: str) -> float:
    """An attribute that is one number; infinity and NaN are left to who reads it."""
    value = np.asarray(attributes[name])
    if value.shape != () or value.dtype.kind not in "fiu":
        raise ValueError(f"attribute '{name}' is not a number")
    return float(value)


def condition(attributes: Any, name: str) -> float:
    """An attribute that is a condition number; infinity and NaN are left to who reads it."""
    value = number(attributes, name)
    if value < 1.0 - 1e-9:
        raise ValueError(f"attribute '{name}' is below 1, as no condition number is")
    return value


def count(attributes: Any, name: str) -> int:
    """An attribute that is a whole number, not below 0."""
    value = number(attributes, name)
    if not (0 <= value < 2**53 and value == int(value)):
        raise ValueError(f"attribute '{name}' is not a count")
    return int(attributes[name])


def flag(attributes: Any, name: str) -> bool:
    """An attribute that is true or false."""
    value = np.asarray(attributes[name])
    if value.shape != () or value.dtype.kind != "b":
        raise ValueError(f"attribute '{name}' is neither true nor false")
    return bool(value)


def array(dataset: Any, shape: Shape, finite: bool = True) -> Array:
    """Numbers of this shape (None: any length)."""
    found = _shaped(dataset, shape, "fiu").astype(float)
    if finite and not (np.abs(found) < _BEYOND).all():
        raise ValueError(f"{dataset.name} has values that are not finite, or beyond all measure")
    return found


def indices(dataset: Any) -> NDArray[np.intp]:
    """Whole numbers (k,), each once."""
    found = _shaped(dataset, (None,), "iu").astype(np.intp)
    if len(set(found.tolist())) != len(found) or (found < 0).any():
        raise ValueError(f"{dataset.name} is not a valid choice of indices")
    return found


def flags(dataset: Any, shape: Shape) -> NDArray[np.bool_]:
    """True or false, of this shape."""
    return _shaped(dataset, shape, "b")


def record(value: Any, kind: Any) -> Any:
    """A record of `kind` from its JSON text."""
    words = value.decode() if isinstance(value, bytes) else value
    if not isinstance(words, str):
        raise ValueError("a record is not text")
    return _adapter(kind).validate_python(json.loads(words))


def require_joints(
    joints: Sequence[str], errors: Sequence[Errors], noise_floor: Mapping[str, float] | None
) -> None:
    """Raise ValueError where they are of other joints."""
    found: list[Mapping[str, float]] = [
        mapping
        for each in errors
        for mapping in (each.relative, each.relative_moving, each.rms, each.rms_raw)
    ]
    found += [each.samples for each in errors if each.samples]
    others = set(noise_floor or ()) - set(joints)
    if others or any(set(mapping) != set(joints) for mapping in found):
        raise ValueError("its errors are those of other joints")


@lru_cache(maxsize=8)
def stored_spec(config: str, source: str) -> Spec:
    """The config that a file holds; read once for a file that is opened several times.

    Raises
    ------
    ConfigError
        It says what is not allowed; `source`, the file, is named.
    """
    return parse_spec(config, f"the config stored in {source}")


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _shaped(dataset: Any, shape: Shape, kinds: str) -> NDArray[Any]:
    found = np.asarray(dataset)
    if found.dtype.kind not in kinds:
        raise ValueError(f"{dataset.name} holds values of another kind")
    fits = found.ndim == len(shape) and all(
        wanted is None or size == wanted for size, wanted in zip(found.shape, shape, strict=True)
    )
    if not fits:
        wanted = " x ".join("any" if size is None else str(size) for size in shape)
        given = " x ".join(map(str, found.shape)) or "one number"
        raise ValueError(f"{dataset.name} has the shape {given} instead of {wanted}")
    return found


def _word(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{what} is not a list of texts")
    return value
