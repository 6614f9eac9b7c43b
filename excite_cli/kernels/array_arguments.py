"""What a compiled function takes, and the checks before it is entered.

Shapes are written in the sizes that C is given, one letter each: `("T", "B", 3)` is an array of
T × B × 3. A size is what the first array that names it has there; every later array must agree.
"""

import ctypes
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Sizes = dict[str, int]

# Six times faster than `array.ctypes.data`, but refuses read-only arrays.
_START: Any = ctypes.c_char * 0
_TERM = re.compile(r"([+-]?)(\d*)([A-Za-z]?)")


@dataclass(frozen=True)
class Sum:
    """A sum of sizes that are settled, as `12V+42B` or `F-4`."""

    text: str
    terms: tuple[tuple[int, str], ...]  # factor and letter, "" for a plain number

    @classmethod
    def parsed(cls, text: str) -> "Sum":
        """From its text."""
        found = [match.groups() for match in _TERM.finditer(text) if match.group()]
        return cls(text, tuple((int(sign + (number or "1")), size) for sign, number, size in found))

    def of(self, sizes: Sizes) -> int:
        """Its value."""
        return sum(factor * sizes[size] if size else factor for factor, size in self.terms)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Size:
    """A size that C is given; it comes from the arrays, not from the caller."""

    letter: str
    c_type = ctypes.c_int64


@dataclass(frozen=True)
class Number:
    """A single double."""

    name: str
    c_type = ctypes.c_double


@dataclass(frozen=True)
class Array:
    """A C-contiguous array; `scratch` is made for the call, the caller does not give it."""

    name: str
    axes: tuple[int | str | Sum, ...]
    dtype: np.dtype[Any]
    use: Literal["read", "written", "scratch"]
    c_type = ctypes.c_void_p

    def start(self, given: Any, sizes: Sizes) -> Any:
        """Where `given` begins, for C; sizes that are met for the first time go into `sizes`.

        Raises
        ------
        TypeError
            Not an array, of another type, not contiguous, or read-only where C writes.
        ValueError
            Its shape is not that of `axes` with the sizes settled so far.
        """
        if not isinstance(given, np.ndarray) or given.dtype != self.dtype:
            found = given.dtype if isinstance(given, np.ndarray) else type(given).__name__
            raise TypeError(f"{self.name} is {found}, not an array of {self.dtype}")
        flags = given.flags
        if not flags.c_contiguous:
            raise TypeError(f"{self.name} is not C-contiguous")
        if not flags.writeable and self.use == "written":
            raise TypeError(f"{self.name} is read-only and would be written")
        if not self._agrees(given.shape, sizes):
            raise ValueError(self._mismatch(given.shape, sizes))
        return _START.from_buffer(given) if flags.writeable else given.ctypes.data

    def empty(self, sizes: Sizes) -> np.ndarray:
        """An array of this shape, whatever it holds."""
        return np.empty([_length(axis, sizes) for axis in self.axes], self.dtype)

    def _agrees(self, shape: tuple[int, ...], sizes: Sizes) -> bool:
        if len(shape) != len(self.axes):
            return False
        for axis, length in zip(self.axes, shape, strict=True):
            wanted = sizes.setdefault(axis, length) if type(axis) is str else _length(axis, sizes)
            if wanted != length:
                return False
        return True

    def _mismatch(self, shape: tuple[int, ...], sizes: Sizes) -> str:
        axes = ", ".join(map(str, self.axes))
        known = ", ".join(f"{letter} = {size}" for letter, size in sizes.items())
        return f"{self.name} has shape {shape}, not ({axes}) with {known}"


def _length(axis: int | str | Sum, sizes: Sizes) -> int:
    if isinstance(axis, int):
        return axis
    return sizes[axis] if isinstance(axis, str) else axis.of(sizes)


class CheckedFunction:
    """A function of the compiled library that is entered only with arguments that fit."""

    def __init__(
        self, name: str, function: Any, signature: Sequence[Size | Number | Array]
    ) -> None:
        self._name, self._function = name, function
        function.restype = None
        function.argtypes = [argument.c_type for argument in signature]
        places = list(enumerate(signature))
        self._count = len(places)
        self._sizes = [(i, one.letter) for i, one in places if isinstance(one, Size)]
        arrays = [(i, one) for i, one in places if isinstance(one, Array)]
        self._scratch = [(i, one) for i, one in arrays if one.use == "scratch"]
        made = {i for i, _ in self._scratch}
        self._given = [(i, one) for i, one in places if not isinstance(one, Size) and i not in made]

    def __call__(self, given: Sequence[Any]) -> None:
        """Run it on numbers and arrays in the order of the signature.

        Raises
        ------
        TypeError, ValueError
            See `Array.start`; or there are too many arguments or too few.
        """
        if len(given) != len(self._given):
            names = ", ".join(one.name for _, one in self._given)
            raise TypeError(f"kernel {self._name} takes {names}: {len(given)} arguments were given")
        passed: list[Any] = [None] * self._count
        sizes: Sizes = {}
        try:
            for (place, argument), value in zip(self._given, given, strict=True):
                passed[place] = (
                    value if isinstance(argument, Number) else argument.start(value, sizes)
                )
        except (TypeError, ValueError) as error:
            raise type(error)(f"kernel {self._name}: {error}") from None
        for place, letter in self._sizes:
            passed[place] = sizes[letter]
        scratch = [array.empty(sizes) for _, array in self._scratch]
        for (place, _), array in zip(self._scratch, scratch, strict=True):
            passed[place] = _START.from_buffer(array)
        self._function(*passed)
