"""Attributes of HDF5 files from anywhere, looked at before they are read.

A few damaged bytes turn an array of texts into one of lists, and HDF5 follows the addresses that it
finds there: the process dies. So only numbers, texts and truth values are read.
"""

from typing import Any

import h5py

_PLAIN = (h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.STRING, h5py.h5t.ENUM)


def attribute(item: Any, name: str, default: Any = None) -> Any:
    """The attribute `name` of a file, group or dataset; `default` where there is none.

    Raises
    ------
    ValueError
        It holds neither numbers nor texts.
    """
    if name not in item.attrs:
        return default
    require_plain(item, name)
    return item.attrs[name]


def require_plain(item: Any, *names: str) -> None:
    """See that these attributes, or all of them, hold numbers or texts; ValueError if not."""
    for name in names or item.attrs:
        if h5py.h5a.open(item.id, name.encode()).get_type().get_class() not in _PLAIN:
            raise ValueError(f"the attribute {name!r:.80} holds neither numbers nor texts")
