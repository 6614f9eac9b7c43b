"""What all sections of a problem share: numbers with their limits, and a strict base class."""

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    model_validator,
)

from excite_cli.shown.note import readable


@readable
def _not_a_truth_value(value: Any) -> Any:
    """Pydantic takes true for 1; a person who writes true means something else."""
    if isinstance(value, bool):
        raise ValueError("allowed: a number, not true or false")
    return value


_NO_TRUTH_VALUE = BeforeValidator(_not_a_truth_value)
Integer = Annotated[int, _NO_TRUTH_VALUE]
# Beyond these a figure is a mistake, and arithmetic with it overflows.
_MOST, _LEAST = 1e9, 1e-15


def _not_vanishing(value: float) -> float:
    if 0 < value < _LEAST:
        raise ValueError(f"allowed: a number of at least {_LEAST:g}")
    return value


Finite = Annotated[float, Field(ge=-_MOST, le=_MOST, allow_inf_nan=False), _NO_TRUTH_VALUE]
Positive = Annotated[
    float,
    Field(gt=0, le=_MOST, allow_inf_nan=False),
    AfterValidator(_not_vanishing),
    _NO_TRUTH_VALUE,
]
NonNegative = Annotated[float, Field(ge=0, le=_MOST, allow_inf_nan=False), _NO_TRUTH_VALUE]
Duration = Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False), _NO_TRUTH_VALUE]
Frequency = Annotated[float, Field(gt=0, le=630, allow_inf_nan=False), _NO_TRUTH_VALUE]
Power = Annotated[float, Field(ge=1, le=1e4, allow_inf_nan=False), _NO_TRUTH_VALUE]
Samples = Annotated[int, Field(ge=2, le=1_000_000), _NO_TRUTH_VALUE]
Motions = Annotated[int, Field(ge=1, le=1000), _NO_TRUTH_VALUE]
Harmonics = Annotated[int, Field(ge=1, le=100), _NO_TRUTH_VALUE]
ControlPoints = Annotated[int, Field(ge=4, le=500), _NO_TRUTH_VALUE]
Share = Annotated[float, Field(gt=0, le=1), _NO_TRUTH_VALUE]
Vector3 = tuple[Finite, Finite, Finite]


class Section(BaseModel):
    """Base of all sections: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", str_strip_whitespace=True)

    gone: ClassVar[dict[str, tuple[tuple[Any, ...], str]]] = {}
    """Keys of earlier versions: values that change nothing, as stored results have them, and what
    to do about any other."""

    @model_validator(mode="before")
    @classmethod
    def _without_what_is_gone(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        for key, (idle, advice) in cls.gone.items():
            if key in value and value[key] not in idle:
                raise ValueError(f"{key}: {advice} (given: {value[key]!r:.40})")
        return {key: each for key, each in value.items() if key not in cls.gone}

    @classmethod
    def child(cls, key: str, value: Any) -> "type[Section] | None":
        """The section that `value` under `key` is meant to be; None for plain values.

        Of several kinds, the one whose tag (`family`, `kind`) is given, else the first.
        """
        if key not in cls.model_fields:
            return None
        kinds = _sections_in(cls.model_fields[key].annotation)
        given = value if isinstance(value, dict) else {}
        for kind in kinds:
            for tag in ("family", "kind"):
                field = kind.model_fields.get(tag)
                if field is not None and given.get(tag) in get_args(field.annotation):
                    return kind
        return kinds[0] if kinds else None


def _sections_in(annotation: Any) -> list[type[Section]]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [kind for inner in get_args(annotation) for kind in _sections_in(inner)]


def kind_by(key: str, default: str) -> Callable[[Any], Any]:
    """Tells which kind of section is meant: what stands under `key`, else `default`."""

    @readable
    def kind(value: Any) -> Any:
        if isinstance(value, dict):
            return value.get(key, default)
        return getattr(value, key, default)

    return kind
