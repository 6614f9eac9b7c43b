"""The compiled inner loops, called through ctypes, which lets other threads run.

The C files beside this one are compiled when the package is built. Where that could not be done,
`KERNELS` is None and the NumPy forms beside each caller take over: the same figures to rounding,
two to ten times slower.
`EXCITE_KERNELS=numpy` in the environment asks for them.
"""

import ctypes
import importlib.util
import os

from excite_cli.arrays import Array, Indices
from excite_cli.kernels.array_arguments import CheckedFunction
from excite_cli.kernels.signatures import SIGNATURES

_ASKED = "EXCITE_KERNELS"
_VERSION = 2  # that of the C files; raise both when a function takes other arguments


class Kernels:
    """The compiled functions, each with the arguments that `signatures.py` declares."""

    def __init__(self, library: ctypes.CDLL) -> None:
        if library.version() != _VERSION:
            raise OSError("compiled from another version of the C files")
        self._functions = {
            name: CheckedFunction(name, getattr(library, name), signature)
            for name, signature in SIGNATURES.items()
        }

    def call(self, name: str, *given: float | Array | Indices) -> None:
        """Run one function on arrays and numbers; sizes come from the shapes.

        Raises
        ------
        TypeError
            An array is of another type, not contiguous, or read-only where it would be written.
        ValueError
            The shapes do not agree, or there are too many arguments or too few.
        """
        self._functions[name](given)


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
