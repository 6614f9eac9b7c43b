"""ROS bags without ROS: rosbag2 (`.db3`, `.mcap`, or their folder) and ROS 1 (`.bag`).

Only JointState, and what `bag_sensors` reads, is decoded, with the definitions that come with the
library: message definitions stored in a bag are never compiled.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from excite_cli.config.plain_yaml import parse_plain
from excite_cli.errors import ExciteError, FileError, nearest, optional_module
from excite_cli.measurement.bag_sensors import SensorMessages, types_of, with_sensors
from excite_cli.measurement.base_channel import BaseChannel
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.joint_states import JointStates
from excite_cli.measurement.reader import RawRun, Reader, ReadOptions, check_size, check_values

_STATES = ("sensor_msgs/msg/JointState",)
_LISTED = 20  # topics that are reported
_STORAGE = (".db3", ".mcap")
_MAX_METADATA = 500_000  # bytes


class BagReader(Reader):
    """Bags of JointState messages, and of sensors of the base beside them."""

    title = "ROS bag"
    suffixes = (*_STORAGE, ".bag")

    def recognises(self, path: Path) -> bool:
        """Files by their suffix; folders that hold a rosbag2."""
        if path.is_dir():
            return (path / "metadata.yaml").is_file() or bool(_stored(path))
        return super().recognises(path)

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The bag's only run: one topic of JointState, in the order of its stamps."""
        optional_module(
            "rosbags.rosbag2",
            "Reading ROS bags needs the library rosbags: pip install 'excite-cli[bags]'",
        )
        check_bag(path)
        try:
            with ExitStack() as stack:
                readers = [stack.enter_context(reader) for reader in _readers(path)]
                run = _run(_Bag(path, readers), wanted)
        except ExciteError:
            raise
        # The library lets pass whatever damaged bytes lead to: assertions, struct and database
        # errors, wrong enumerations. None of it is ours, and all of it means the same.
        except Exception as error:
            raise FileError(_damaged(path, error)) from error
        pending = path.with_name(f"{path.name}-wal")
        if pending.is_file() and pending.stat().st_size:
            text = (
                f"{pending.name} lies beside the bag: the recorder was not closed, and its last "
                "messages are not read. `ros2 bag reindex` repairs it"
            )
            found = Finding("truncated", "warning", text)
            run = replace(run, findings=(*run.findings, found))
        return [run]


def check_bag(path: Path) -> None:
    """Refuse what the library would take forever for, or fill memory with: size and metadata.

    Raises
    ------
    FileError
        A storage file is too large, or metadata.yaml is, or it is more than plain values.
    """
    for file in _stored(path) if path.is_dir() else [path]:
        check_size(file)
    metadata = path / "metadata.yaml"
    if not metadata.is_file():
        return
    if metadata.stat().st_size > _MAX_METADATA:
        raise FileError(
            f"{metadata} is larger than {_MAX_METADATA // 1000} kB. Give one storage file of the "
            "bag, or split the recording."
        )
    try:
        parse_plain(metadata.read_text(encoding="utf-8"), str(metadata))
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{metadata} cannot be read as text: {error}.") from error


def _stored(folder: Path) -> list[Path]:
    files = (file for file in folder.iterdir() if file.suffix in _STORAGE)
    return sorted(files, key=lambda file: [int(n) for n in re.findall(r"\d+", file.stem)][-1:])


def _readers(path: Path) -> list[Any]:
    """The bag, or each storage file of a folder without metadata.yaml."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

    if set(str(path)) & set("?#%"):
        raise FileError(f"{path}: a bag's path must not hold ?, # or %. Rename it.")
    if path.suffix == ".bag" and not path.is_dir():
        return [Reader1(path)]
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        return [Reader2(path)]
    return [Reader2(file) for file in _stored(path)]


class _Bag:
    """The topics of an open bag, whatever number of files it is in."""

    def __init__(self, path: Path, readers: list[Any]) -> None:
        from rosbags.typesys import Stores, get_typestore

        self.path, self._readers = path, readers
        first = path.suffix == ".bag" and not path.is_dir()
        store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
        self._decode = store.deserialize_ros1 if first else store.deserialize_cdr
        self._all = [connection for reader in readers for connection in reader.connections]

    def topics(self, types: Sequence[str]) -> dict[str, int]:
        """Topics of one of these message types, with their numbers of messages."""
        found: dict[str, int] = {}
        for each in self._all:
            if _full(each.msgtype) in types:
                found[each.topic] = found.get(each.topic, 0) + each.msgcount
        return found

    def types_of(self, topic: str) -> list[str]:
        """Message types of a topic; none if there is no such topic."""
        return sorted({_full(each.msgtype) for each in self._all if each.topic == topic})

    def described(self) -> str:
        """All topics with their types, for a message."""
        there = sorted({f"{each.topic} ({each.msgtype})" for each in self._all})
        return ", ".join(there[:_LISTED]) or "no topics"

    def messages(self, topic: str, types: Sequence[str]) -> Iterator[tuple[int, Any]]:
        """When each was recorded [ns], and the message decoded."""
        for reader in self._readers:
            chosen = [c for c in reader.connections if c.topic == topic]
            chosen = [c for c in chosen if _full(c.msgtype) in types]
            if chosen:
                for connection, stamp, data in reader.messages(connections=chosen):
                    yield int(stamp), self._decode(data, _full(connection.msgtype))


def _full(name: str) -> str:
    """`sensor_msgs/msg/Imu` of `sensor_msgs/Imu`, too."""
    return name if "/msg/" in name else name.replace("/", "/msg/")


def _run(bag: _Bag, wanted: ReadOptions) -> RawRun:
    """Joint states, and the sensors that the config names on their stamps."""
    topic = _topic(bag, wanted)
    sensors = {channel: _sensor_topic(bag, channel) for channel in wanted.apart}
    count = 20 * bag.topics(_STATES)[topic]
    for channel, name in sensors.items():
        count += (len(channel.parts) + 2) * bag.topics(types_of(channel))[name]
    check_values(bag.path, count)
    states = JointStates(topic)
    for stamp, message in bag.messages(topic, _STATES):
        states.add(stamp, message)
    run, stamps = states.run(bag.path, wanted)
    sampled = []
    for channel, name in sensors.items():
        gathered = SensorMessages(bag.path, name, channel)
        for stamp, message in bag.messages(name, types_of(channel)):
            gathered.add(stamp, message)
        sampled.append(gathered.at(stamps))
    return with_sensors(bag.path, run, sampled)


def _topic(bag: _Bag, wanted: ReadOptions) -> str:
    states = bag.topics(_STATES)
    topics = sorted(states)
    if wanted.topic is not None:
        if wanted.topic in topics:
            return wanted.topic
        hint = nearest(wanted.topic, topics)
        raise FileError(
            f"{bag.path} has no JointState topic '{wanted.topic}' (measurement.topic).{hint} "
            f"It has: {', '.join(topics) or 'none'}."
        )
    if not topics:
        raise FileError(
            f"{bag.path} has no topic of type sensor_msgs/JointState; it has: {bag.described()}."
        )
    if len(topics) > 1:
        counts = ", ".join(f"{topic} ({states[topic]} messages)" for topic in topics)
        raise FileError(
            f"{bag.path} has several JointState topics: {counts}. Name one: measurement.topic: "
            f"{topics[0]}"
        )
    return topics[0]


def _sensor_topic(bag: _Bag, channel: BaseChannel) -> str:
    """The topic that a channel names, with or without the slash that topics begin with."""
    types = types_of(channel)
    topics = bag.topics(types)
    names = channel.declared, f"/{channel.declared}"
    for name in names:
        if name in topics:
            return name
    hint = nearest(names[1].replace("//", "/"), topics)
    if found := [each for name in names for each in bag.types_of(name)]:
        raise FileError(
            f"{bag.path}: topic '{channel.declared}' ({channel.where}) is of type {found[0]}; read "
            f"are {', '.join(types)}.{hint} Of these types it has: {', '.join(topics) or 'none'}."
        )
    raise FileError(
        f"{bag.path} has no topic '{channel.declared}', which {channel.where} names.{hint} It has: "
        f"{bag.described()}."
    )


def _damaged(path: Path, error: Exception) -> str:
    mend = {
        ".bag": "`rosbag reindex`",
        ".mcap": "`mcap recover`",
    }.get(path.suffix, "`ros2 bag reindex`, or `.recover` of sqlite3,")
    beside = ""
    if path.is_file() and (path.parent / "metadata.yaml").is_file():
        beside = f" If it is one of a compressed bag, give the folder {path.parent} instead."
    reason = str(error).strip().splitlines()[0][:200] if str(error).strip() else ""
    return (
        f"{path} is a damaged or cut off bag ({type(error).__name__}"
        f"{': ' if reason else ''}{reason.rstrip('.')}). {mend} may repair it.{beside}"
    )
