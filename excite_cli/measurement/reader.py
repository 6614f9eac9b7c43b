"""What a reader of measured files is: a path in, recordings with named columns out.

A reader knows a format, not the robot: columns keep the file's joint names, units and signs. What
they mean is settled later, by `arrange` (names) and `torque` (units), from what the YAML declares.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from excite_cli.errors import FileError

if TYPE_CHECKING:
    from excite_cli.measurement.base_channel import BaseChannel
    from excite_cli.measurement.dataset import Array, Finding


MAX_BYTES = 4 * 2**30  # of a file
MAX_VALUES = 2**28  # numbers taken from a file: 2 GiB in memory
ALWAYS, PACKED = 2**27, 50  # bytes that any file may unpack to; times its size
CHANNELS = ("q", "dq", "tau")
SENT = ("q_cmd", "v_cmd", "tau_ff", "voltage", "duty")  # what drives were sent, a column per joint
FIELDS = {"q": "position", "dq": "velocity", "tau": "effort"}  # of JointState
SINCE_1970 = 1e9  # s: no clock that counts from its own start has come so far


@dataclass(frozen=True)
class ReadOptions:
    """What a reader is given: the YAML's hints on where things stand in a file.

    `channels`: the file's name of t, q, dq, tau where it differs; None leaves a channel out.
    `rate` [Hz] of files without time stamps; `topic` of a bag; `joints` the robot's names with
    `names` (file's name -> joint), for readers that must choose between sources. `beside` the
    positions these channels are needed. Channels `apart` belong to no joint, whatever they are
    called and however many columns they have; without them nothing can be said either.
    """

    joints: tuple[str, ...]
    names: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[str, str | None] = field(default_factory=dict)
    rate: float | None = None
    topic: str | None = None
    beside: tuple[str, ...] = ("tau",)
    apart: tuple[BaseChannel, ...] = ()

    @property
    def needed(self) -> tuple[str, ...]:
        """Channels without which nothing can be said."""
        return ("q", *self.beside)

    def is_apart(self, column: str) -> bool:
        """Whether a column or array of that name belongs to no joint."""
        return any(channel.holds(column) for channel in self.apart)

    def called(self, channel: str) -> str | None:
        """The file's name of a channel; None if it is to be left out."""
        return self.channels.get(channel, channel)

    def channel(self, name: str) -> str:
        """The channel that the file calls `name`; its own name if it is none of ours.

        A file's own `tau` beside `channels: {tau: current}` stays, as `tau_in_file`.
        """
        for channel, given in self.channels.items():
            if given == name:
                return channel
        return f"{name}_in_file" if name in self.channels else name


@dataclass(frozen=True)
class RawRun:
    """One recording as the file has it.

    `columns`: channel -> the file's joint name -> (T,). `others`: channels that belong to no
    joint. `numbered`: the joint names are only numbers. `name` is empty if the file gives none.
    `seconds`: t is in seconds whatever the YAML declares (bags, and stamps made from a rate).
    `place` in the file: a group or a topic. `epoch`: seconds from 1970 to t = 0, if known.
    """

    name: str
    t: Array
    columns: Mapping[str, Mapping[str, Array]]
    others: Mapping[str, Array] = field(default_factory=dict)
    numbered: bool = False
    seconds: bool = False
    findings: tuple[Finding, ...] = ()
    place: str = ""
    epoch: float | None = None


class Reader(ABC):
    """A file format."""

    title: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]

    def recognises(self, path: Path) -> bool:
        """Whether it is a file whose name is one of this format."""
        return path.name.lower().endswith(self.suffixes) and not path.is_dir()

    @abstractmethod
    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """All recordings of a file; FileError if it is damaged, too large, or lacks something."""


def check_size(path: Path) -> None:
    """Refuse files of more than `MAX_BYTES`."""
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise FileError(
            f"{path} has {size / 2**30:.1f} GiB; measured files of up to {MAX_BYTES / 2**30:.0f} "
            "GiB are read. Cut it into several runs, or lower its rate."
        )


def check_values(path: Path, count: int) -> None:
    """Refuse files that hold (or claim to hold) more than `MAX_VALUES` numbers."""
    if count > MAX_VALUES:
        raise FileError(
            f"{path} holds {count:,} numbers; up to {MAX_VALUES:,} are read. Cut it into several "
            "runs, or lower its rate."
        )


def check_unpacked(path: Path, claimed: int) -> None:
    """Refuse files that make far more of themselves than they have: `claimed` bytes in memory.

    Packed zeros, and shapes without anything stored, are a thousand times as large and more.
    Recordings pack to a tenth.
    """
    size = path.stat().st_size
    if claimed > ALWAYS and claimed > PACKED * size:
        raise FileError(
            f"{path} has {size / 2**20:.3g} MiB and claims to hold {claimed / 2**20:,.0f} MiB: it "
            "is damaged, or made to fill the memory. No recording packs so well."
        )


def times_from_rate(path: Path, samples: int, wanted: ReadOptions, found: str) -> Array:
    """Time stamps of a file that has none, from `measurement.rate`, [s]."""
    if wanted.rate is None:
        raise FileError(
            f"{path} has no time stamps '{wanted.called('t')}'; it has: {found}. Name them with "
            "measurement.channels: {t: …}, or give the sampling rate: measurement.rate: … [Hz]."
        )
    return np.arange(samples) / wanted.rate
