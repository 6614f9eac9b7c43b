"""The compiled inner loops, called through ctypes, which lets other threads run.

The C files beside this one are compiled when the package is built. Where that could not be done,
`KERNELS` is None and the NumPy forms beside each caller take over: the same figures to rounding,
two to ten times slower.
`EXCITE_KERNELS=numpy` in the environment asks for them.
"""

import ctypes
import importlib.util
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_NAMES = (
    "placements", "axes", "regressor", "pull_back", "distances", "gradients", "squared", "bicubic",
)  # fmt: skip
_ASKED = "EXCITE_KERNELS"
_VERSION = 2  # that of the C files; raise both when a function takes other arguments


class Kernels:
    """The compiled functions; arrays must be C-contiguous float64 and int64."""

    def __init__(self, library: ctypes.CDLL) -> None:
        if library.version() != _VERSION:
            raise OSError("compiled from another version of the C files")
        self._functions = {name: getattr(library, name) for name in _NAMES}
        for function in self._functions.values():
            function.restype = None

    def call(self, name: str, *arguments: int | float | Array | Indices) -> None:
        """Run one function: integers as sizes, floats as doubles, arrays as their first entry.

        Raises
        ------
        TypeError
            An array is not contiguous, or of another type than float64 and int64.
        """
        self._functions[name](*[_passed(argument) for argument in arguments])


def _passed(argument: int | float | Array | Indices) -> Any:
    if isinstance(argument, np.ndarray):
        if not argument.flags.c_contiguous or argument.dtype not in (np.float64, np.int64):
            raise TypeError(f"a kernel cannot take an array of {argument.dtype} as it lies")
        return ctypes.c_void_p(argument.ctypes.data)
    if isinstance(argument, float):
        return ctypes.c_double(argument)
    return ctypes.c_int64(argument)


def _loaded() -> Kernels | None:
    if os.environ.get(_ASKED) == "numpy":
        return None
    found = importlib.util.find_spec("excite_cli.kernels._kernels")
    if found is None or found.origin is None:
        return None
    try:
        return Kernels(ctypes.CDLL(found.origin))
    except (OSError, AttributeError):  # of another machine, or of another version
        return None


KERNELS = _loaded()
"""The compiled functions, or None."""
