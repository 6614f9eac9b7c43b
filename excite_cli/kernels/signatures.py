"""The arguments of every compiled function, in the order of C.

T instants, B bodies, V degrees of freedom, n moved joints, R measured rows, r kept columns;
C capsules, P pairs of them, K chosen places, F and S knots along both axes of a table.
What index arrays hold is not looked at: that would take longer than some of the loops.
"""

import numpy as np

from excite_cli.kernels.array_arguments import Array, Number, Size, Sum

_FLOAT, _WHOLE = np.dtype(np.float64), np.dtype(np.int64)


def _read(name: str, *axes: int | str) -> Array:
    return Array(name, _axes(axes), _FLOAT, "read")


def _indices(name: str, *axes: int | str) -> Array:
    return Array(name, _axes(axes), _WHOLE, "read")


def _written(name: str, *axes: int | str) -> Array:
    return Array(name, _axes(axes), _FLOAT, "written")


def _scratch(*axes: int | str) -> Array:
    return Array("work", _axes(axes), _FLOAT, "scratch")


def _axes(axes: tuple[int | str, ...]) -> tuple[int | str | Sum, ...]:
    plain = [isinstance(axis, int) or (len(axis) == 1 and axis.isalpha()) for axis in axes]
    return tuple(a if ok else Sum.parsed(str(a)) for a, ok in zip(axes, plain, strict=True))


def _sizes(letters: str) -> tuple[Size, ...]:
    return tuple(map(Size, letters))


_PLACEMENTS = (_read("rotations", "T", "B", 3, 3), _read("translations", "T", "B", 3))
_STATES = (_read("v", "T", "n"), _read("a", "T", "n"))
_TREE = (
    _indices("parents", "B"),
    _indices("dof_body", "V"),
    _indices("variable", "B"),
    _indices("moved", "n"),
    _indices("row_dof", "R"),
    _read("carries", "B", "V"),
    _read("axis", "V", 6),
    _read("gravity", 6),
)
_CAPSULES = (
    _indices("joints", "C"),
    _read("start", "C", 3),
    _read("along", "C", 3),
    _indices("first", "P"),
    _indices("second", "P"),
)

SIGNATURES: dict[str, tuple[Size | Number | Array, ...]] = {
    "placements": (
        *_sizes("TBn"),
        _indices("parents", "B"),
        _indices("variable", "B"),
        _read("basis", "B", 3, 9),
        _read("offset", "B", 3),
        _read("slide", "B", 3),
        _read("q", "T", "n"),
        _written("rotations", "T", "B", 3, 3),
        _written("translations", "T", "B", 3),
    ),
    "axes": (
        *_sizes("TBV"),
        _indices("dof_body", "V"),
        _read("axis", "V", 6),
        *_PLACEMENTS,
        _written("columns", "T", "V", 6),
    ),
    "regressor": (
        *_sizes("TBVnR"),
        *_TREE,
        *_PLACEMENTS,
        *_STATES,
        _indices("position", "10B"),
        Size("r"),
        _scratch("12V+24B"),
        _written("found", "T", "R", "r"),
    ),
    "pull_back": (
        *_sizes("TBVnR"),
        *_TREE,
        _read("by_spin_once", 18, 3),
        _read("by_spin_twice", 18, 9),
        *_PLACEMENTS,
        *_STATES,
        _read("weights", "T", "R", "10B"),
        _scratch("12V+42B"),
        _written("gq", "T", "n"),
        _written("gv", "T", "n"),
        _written("ga", "T", "n"),
    ),
    "distances": (
        *_sizes("TBCP"),
        *_CAPSULES,
        _read("radii", "P"),
        _read("balls", "P"),
        Number("exact_below"),
        *_PLACEMENTS,
        _scratch("9C"),
        _written("found", "T", "P"),
    ),
    "gradients": (
        *_sizes("KBVn"),
        *_CAPSULES,
        _read("sign", "P", "n"),
        _indices("moved", "n"),
        *_PLACEMENTS,
        _read("columns", "T", "V", 6),
        _indices("times", "K"),
        _indices("pair", "K"),
        _written("found", "K", "n"),
    ),
    "squared": (
        *_sizes("Kn"),
        _indices("times", "K"),
        _read("weights", "K"),
        _read("left", "K", "n"),
        _read("right", "K", "n"),
        _written("found", "T", "n", "n"),
    ),
    "bicubic": (
        *_sizes("KFS"),
        _read("first", "F"),
        _read("second", "S"),
        _read("coefficients", "F-4", "S-4"),
        _read("at", "K", 2),
        _written("found", "K", 3),
    ),
}
