"""Files that hold channels of one recording each, joined to the recording.

A logger may write positions, speeds, torques and wrenches into files of their own. Where a file
lacks positions, torques or sensors of the base, it is joined with the others of that kind by its
time stamps, which must be the same to the last digit: nothing is interpolated or guessed.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.reader import RawRun, ReadOptions

_WORDS = {  # without which nothing can be said
    "q": "positions", "tau": "torques", "q_cmd": "position set points", "voltage": "voltages",
    "duty": "duty cycles",
}  # fmt: skip


def is_part(raw: RawRun, wanted: ReadOptions) -> bool:
    """Whether it lacks positions, torques, or channels apart, of those that are needed."""
    held = (any(map(channel.holds, raw.others)) for channel in wanted.apart)
    return _lacks_joints(raw, wanted) or not all(held)


def _lacks_joints(raw: RawRun, wanted: ReadOptions) -> bool:
    return any(not raw.columns.get(channel) for channel in wanted.needed)


def with_joined(
    files: Sequence[tuple[Path, list[RawRun]]], wanted: ReadOptions
) -> list[tuple[Path, list[RawRun]]]:
    """The recordings of `files`, parts of one joined in place of the first of them.

    What lacks only channels apart stays as it is where there is no other part that could have them.

    Raises
    ------
    FileError
        Stamps differ, a channel is there twice, or positions or torques are in none of them.
    """
    parts = [(path, raw) for path, raws in files for raw in raws if is_part(raw, wanted)]
    if not any(_lacks_joints(raw, wanted) for _, raw in parts):
        return list(files)
    found = [(path, [raw for raw in raws if not is_part(raw, wanted)]) for path, raws in files]
    found[[path for path, _ in files].index(parts[0][0])][1].append(_joined(parts, wanted))
    return [(path, raws) for path, raws in found if raws]


def _joined(parts: Sequence[tuple[Path, RawRun]], wanted: ReadOptions) -> RawRun:
    """One recording of all channels, named by what the files' names begin with alike."""
    path, whole = parts[0]
    names = ", ".join(each.name for each, _ in parts)
    for other, raw in parts[1:]:
        if len(raw.t) != len(whole.t) or not np.array_equal(raw.t, whole.t, equal_nan=True):
            raise FileError(
                f"{names}: {path.name} and {other.name} hold channels of one recording each, with "
                "other time stamps. Put them on the same stamps, or into one file."
            )
        columns = {channel: dict(by_joint) for channel, by_joint in whole.columns.items()}
        for channel, by_joint in raw.columns.items():
            twice = sorted(set(columns.get(channel, {})) & set(by_joint))
            if twice:
                raise FileError(_twice(names, f"'{channel}' of {twice[0]}"))
            columns.setdefault(channel, {}).update(by_joint)
        again = sorted(filter(wanted.is_apart, set(whole.others) & set(raw.others)))
        if again:
            raise FileError(_twice(names, f"'{again[0]}'"))
        others: dict[str, Array] = {**whole.others, **raw.others}
        findings = (*whole.findings, *raw.findings)
        whole = replace(whole, columns=columns, others=others, findings=findings)
    for channel in wanted.needed:
        word = _WORDS.get(channel, channel)
        if not whole.columns.get(channel):
            there = [f"{name}_<joint>" for name, by_joint in whole.columns.items() if by_joint]
            raise FileError(
                f"{names}: no columns '{wanted.called(channel) or channel}_<joint>', so there are "
                f"no {word}; there are: {listed([*there, *whole.others])}. Give the file that has "
                "them as well, or the name they go by: "
                f"measurement.channels: {{{channel}: …}}."
            )
    positions = list(whole.columns["q"])
    stems = [each.name.split(".")[0] for each, _ in parts]
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*stems, strict=False))
    name = "".join(letters[0] for letters in alike).rstrip("_-. ") or stems[0]
    return replace(whole, name=name, numbered=all(each.isdigit() for each in positions))


def _twice(names: str, what: str) -> str:
    return (
        f"{names}: {what} is in more than one of these files. Give the files of one recording "
        "so that each channel is in one file only."
    )
