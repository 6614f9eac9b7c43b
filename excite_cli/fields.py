"""What stands at the field of a record, for whoever stores or shows it: the shape of an array."""

from dataclasses import dataclass


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
