"""Messages between processes of one machine, in which large arrays are named and not copied.

An array that lies in a file of this process (`out_of_core`) travels as the place in that file, and
the other process maps it. What lies in memory and is large is written to such a file first.
"""

import io
import pickle
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.out_of_core import Spool, attached, reference_to

# Bytes of an array that is written to a file, and of one that lies in one already.
_LARGE, _WORTH_NAMING = 2**18, 2**12
POSSIBLE = Path("/proc/self/fd").is_dir()


def packed(message: Any, spool: Spool | None = None) -> bytes:
    """A pickle of `message`; with a `spool`, which is to live until it is read, of little size."""
    if not POSSIBLE:
        return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    buffer = io.BytesIO()
    _Packer(buffer, spool).dump(message)
    return buffer.getvalue()


class _Packer(pickle.Pickler):
    def __init__(self, buffer: io.BytesIO, spool: Spool | None) -> None:
        super().__init__(buffer, pickle.HIGHEST_PROTOCOL)
        self._spool = spool

    def reducer_override(self, value: Any) -> Any:
        if type(value) is not np.ndarray or value.nbytes < _WORTH_NAMING or value.dtype.hasobject:
            return NotImplemented
        if not any(value.strides):  # one value, repeated
            return np.broadcast_to, (value.flat[0], value.shape)
        if self._spool is not None and value.nbytes >= _LARGE:
            value = self._spool.keep(value)
        reference = reference_to(value)
        return NotImplemented if reference is None else (attached, (reference,))
