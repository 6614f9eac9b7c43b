"""JointState messages gathered into arrays.

Messages on one topic need not name the same joints, nor in the same order: several drivers may
share it. They are kept by their list of names; the list that holds the robot's joints is the run.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array, Finding
from excite_cli.measurement.reader import FIELDS, SINCE_1970, RawRun, ReadOptions

# Stamps of messages: of their headers, or of the recorder where headers are empty.

Stamps = NDArray[np.int64]


class MessageStamps:
    """Both stamps of every message [ns], whole: an epoch in seconds leaves 0.2 µs of a double."""

    def __init__(self) -> None:
        self._recorded: list[int] = []
        self._stamped: list[int] = []

    def __len__(self) -> int:
        return len(self._recorded)

    def add(self, recorded: int, stamp: Any) -> None:
        """Take those of a message: when it was recorded [ns], and what its header holds."""
        self._recorded.append(recorded)
        self._stamped.append(int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec))

    def chosen(self) -> tuple[Stamps, bool]:
        """Stamps (T,) of the headers; those of the recorder, and true, where headers are empty."""
        stamped = np.array(self._stamped, dtype=np.int64)
        # A first stamp of 0 is a clock that starts there; more of them, a header left empty.
        empty = bool(np.count_nonzero(stamped <= 0) > 1)
        return (np.array(self._recorded, dtype=np.int64) if empty else stamped), empty


def unstamped_finding(topic: str) -> Finding:
    """What is said of empty headers."""
    text = f"header stamps of {topic} are empty: the time of recording is used, which is less even"
    return Finding("stamps", "note", text)


class _Messages:
    def __init__(self) -> None:
        self.places: list[int] = []
        self.stamps = MessageStamps()
        self.values: dict[str, list[Array]] = {channel: [] for channel in FIELDS}


class JointStates:
    """Messages of one topic; `add` takes them in any order, `run` makes arrays of them."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self._by_names: dict[tuple[str, ...], _Messages] = {}
        self._count = 0

    def add(self, recorded: int, message: Any) -> None:
        """Take a decoded message, recorded at `recorded` [ns]."""
        messages = self._by_names.setdefault(tuple(message.name), _Messages())
        messages.places.append(self._count)
        self._count += 1
        messages.stamps.add(recorded, message.header.stamp)
        for channel, field in FIELDS.items():
            messages.values[channel].append(getattr(message, field))

    def run(self, path: Path, wanted: ReadOptions) -> tuple[RawRun, Stamps]:
        """The messages that hold the robot's joints, as recorded; t from the first stamp [s].

        The stamps (T,) themselves, in ns, are given beside them.

        Raises
        ------
        FileError
            No messages, or they carry no positions, or no efforts if these are needed, or no list
            of names holds the robot's joints.
        """
        if not self._by_names:
            raise FileError(f"{path}: topic {self.topic} has no messages.")
        chosen, findings = self._chosen(path, wanted)
        parts = [self._arrays(path, names, wanted) for names in chosen]
        stamps = np.concatenate([part[0] for part in parts])
        # As recorded: whether stamps go back is for the checks to see and to say.
        order = np.argsort([place for names in chosen for place in self._by_names[names].places])
        columns: dict[str, dict[str, Array]] = {}
        for channel in FIELDS:
            if all(channel in part[1] for part in parts):
                columns[channel] = {
                    joint: np.concatenate([part[1][channel][joint] for part in parts])[order]
                    for joint in chosen[0]
                }
        if any(part[2] for part in parts):
            findings.append(unstamped_finding(self.topic))
        stamps = stamps[order]
        # In whole nanoseconds up to here: an epoch in seconds leaves 0.2 µs of a double.
        t = (stamps - stamps[0]) * 1e-9
        if set(wanted.channels) & {"q", "dq", "tau"}:
            columns = self._renamed(path, columns, wanted)
        epoch = float(stamps[0]) * 1e-9  # of a simulator's clock it is no date
        run = RawRun(
            "", t, columns, {}, False, True, tuple(findings), self.topic,
            epoch if epoch > SINCE_1970 else None,
        )  # fmt: skip
        return run, stamps

    def _chosen(
        self, path: Path, wanted: ReadOptions
    ) -> tuple[list[tuple[str, ...]], list[Finding]]:
        """Lists of names that are orders of the one that holds most of the robot's joints."""

        def moved(names: tuple[str, ...]) -> int:
            return len({wanted.names.get(name, name) for name in names} & set(wanted.joints))

        def rank(names: tuple[str, ...]) -> tuple[int, int]:
            return moved(names), len(self._by_names[names].stamps)

        best = max(self._by_names, key=rank)
        chosen = [names for names in self._by_names if sorted(names) == sorted(best)]
        left = [names for names in self._by_names if names not in chosen]
        spread = [names for names in left if moved(names)]
        if spread and moved(best) < len(wanted.joints):
            lists = "; ".join(", ".join(names) for names in [best, *spread])
            raise FileError(
                f"{path}: topic {self.topic} spreads the robot's joints over several messages "
                f"({lists}). They must come in one message: record the topic of a "
                "joint_state_publisher that joins them."
            )
        findings = []
        if len(chosen) > 1:
            text = f"topic {self.topic} changes the order of joints; matched by name"
            findings.append(Finding("order", "note", text))
        if left:
            count = sum(len(self._by_names[names].stamps) for names in left)
            joints = sorted({name for names in left for name in names})
            text = f"{count} messages of {', '.join(joints) or 'no joints'} left out"
            findings.append(Finding("left_out", "note", text))
        return chosen, findings

    def _arrays(
        self, path: Path, names: tuple[str, ...], wanted: ReadOptions
    ) -> tuple[Stamps, dict[str, dict[str, Array]], bool]:
        messages = self._by_names[names]
        stamps, unstamped = messages.stamps.chosen()
        columns: dict[str, dict[str, Array]] = {}
        for channel, field in FIELDS.items():
            sizes = {len(values) for values in messages.values[channel]}
            if sizes == {len(names)}:
                matrix = np.array(messages.values[channel], dtype=float)
                columns[channel] = dict(zip(names, matrix.T, strict=True))
            elif sizes == {0} and channel not in wanted.needed:
                pass
            elif sizes == {0}:
                needed = " and ".join(FIELDS.get(each, each) for each in wanted.needed)
                raise FileError(
                    f"{path}: messages of topic {self.topic} carry no {field}; needed: {needed}. "
                    "Record a driver that publishes them."
                )
            else:
                raise FileError(
                    f"{path}: messages of topic {self.topic} carry {sorted(sizes)} values of "
                    f"{field} for {len(names)} names; expected {len(names)} in each."
                )
        return stamps, columns, unstamped

    def _renamed(
        self, path: Path, columns: dict[str, dict[str, Array]], wanted: ReadOptions
    ) -> dict[str, dict[str, Array]]:
        for channel in ("q", "dq", "tau"):
            given = wanted.called(channel)
            if given is None:
                columns.pop(channel, None)
            elif given not in (channel, FIELDS[channel]):
                raise FileError(
                    f"{path}: measurement.channels: {{{channel}: {given}}} does not fit a bag; "
                    "JointState has position (q), velocity (dq) and effort (tau)."
                )
        return columns
