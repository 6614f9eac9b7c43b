"""What stands at the fields of records, for whoever stores or shows them: shapes, keys of `--json`.

A record becomes plain values by its fields; nobody has to know it for that.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Shape:
    """Lengths of an array, or of a list of texts, by symbols: `Annotated[Array, shape("m", "n")]`.

    In one record a symbol is one length, as in the records that hold it. `finite`: no infinity and
    no NaN.
    """

    lengths: tuple[str, ...]
    finite: bool = False


def shape(*lengths: str, finite: bool = False) -> Shape:
    """The shape with these symbols."""
    return Shape(lengths, finite)


@dataclass(frozen=True)
class Public:
    """`--json` has the field, under its own name: `Annotated[float, PUBLIC]`."""


PUBLIC = Public()


def data_of(value: Any, *names: str) -> Any:
    """A record, or what it holds, as plain values for JSON; of a record only the fields `names`.

    Numbers of NumPy become plain ones, NaN stays NaN; what has a `code` is told by that.
    """
    if hasattr(value, "code"):
        return value.code
    if is_dataclass(value):
        own = names or [field.name for field in fields(value)]
        return {name: data_of(getattr(value, name)) for name in own}
    if isinstance(value, Mapping):
        return {str(key): data_of(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [data_of(item) for item in value]
    return value.tolist() if hasattr(value, "tolist") else value


def public_data(record: Any) -> dict[str, Any]:
    """The fields of a record that are `PUBLIC`, as plain values."""
    hints = get_type_hints(type(record), include_extras=True)
    own = [
        name
        for name, hint in hints.items()
        if get_origin(hint) is Annotated and PUBLIC in get_args(hint)
    ]
    return dict(data_of(record, *own)) if own else {}
