"""Channels of a run that belong to no joint: six columns of a wrench, three of a gyroscope."""

import numpy as np

from excite_cli.errors import FileError, nearest
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.base_channel import BaseChannel
from excite_cli.measurement.dataset import Array, Run


def channel_of(run: Run, channel: BaseChannel) -> Array:
    """The values (T, width) of a channel: one array of the run, or columns `<name>_x` and so on.

    Raises
    ------
    FileError
        It is missing, of another width, or holds what is not finite.
    """
    name, where, width = channel.name, channel.where, len(channel.parts)
    found = run.extra.get(name)
    if found is None:
        there = [run.extra[column] for column in channel.columns if column in run.extra]
        if len(there) == width:
            found = np.column_stack(there)
    if found is None:
        raise FileError(
            f"run '{run.label}' has no channel '{name}' (nor {channel.columns[0]} … "
            f"{channel.columns[-1]}), which {where} names.{nearest(name, run.extra)} "
            f"Further channels there: {listed(sorted(run.extra))}."
        )
    if found.shape != (len(run.t), width):
        raise FileError(
            f"run '{run.label}': channel '{name}' ({where}) has the shape {found.shape}; expected "
            f"is ({len(run.t)}, {width}): {', '.join(channel.parts)}."
        )
    if not np.isfinite(found).all():
        bad = int(np.sum(~np.isfinite(found).all(axis=1)))
        raise FileError(
            f"run '{run.label}': channel '{name}' ({where}) is not a number in {bad} of "
            f"{len(found)} samples. Cut the run there, or fill them."
        )
    return np.asarray(found, dtype=float)
