"""Channels of a log that belong to no joint, by name: six columns of a wrench, three of a gyro."""

from collections.abc import Sequence

import numpy as np

from excite_cli.errors import FileError, nearest
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array, Run

_PARTS = {
    3: ("x", "y", "z"),
    6: ("fx", "fy", "fz", "mx", "my", "mz"),
    7: ("x", "y", "z", "qx", "qy", "qz", "qw"),
}


def channel_of(run: Run, name: str, width: int, where: str) -> Array:
    """The channel `name` (T, width) of a run: one array, or columns `<name>_x` and so on.

    Raises
    ------
    FileError
        It is missing, of another width, or holds what is not finite.
    """
    found = run.extra.get(name)
    if found is None:
        columns = [run.extra.get(f"{name}_{part}") for part in _PARTS[width]]
        there = [column for column in columns if column is not None]
        if len(there) == width:
            found = np.column_stack(there)
    if found is None:
        raise FileError(
            f"run '{run.label}' has no channel '{name}'{_parts(name, width)}, which {where} names."
            f"{nearest(name, run.extra)} Further channels there: {listed(sorted(run.extra))}."
        )
    if found.shape != (len(run.t), width):
        raise FileError(
            f"run '{run.label}': channel '{name}' ({where}) has the shape {found.shape}; expected "
            f"is ({len(run.t)}, {width}): {', '.join(_PARTS[width])}."
        )
    if not np.isfinite(found).all():
        bad = int(np.sum(~np.isfinite(found).all(axis=1)))
        raise FileError(
            f"run '{run.label}': channel '{name}' ({where}) is not a number in {bad} of "
            f"{len(found)} samples. Cut the run there, or fill them."
        )
    return np.asarray(found, dtype=float)


def _parts(name: str, width: int) -> str:
    parts: Sequence[str] = _PARTS[width]
    return f" (nor {name}_{parts[0]} … {name}_{parts[-1]})"
