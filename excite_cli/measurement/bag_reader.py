"""ROS bags without ROS: rosbag2 (`.db3`, `.mcap`, or their folder) and ROS 1 (`.bag`).

Only sensor_msgs/JointState is decoded, with the definition that comes with the library: message
definitions stored in a bag are never compiled.
"""

import re
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from excite_cli.config.plain_yaml import parse_plain
from excite_cli.errors import ExciteError, FileError, MissingExtraError, nearest
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.joint_states import JointStates
from excite_cli.measurement.reader import RawRun, Reader, ReadOptions, check_size, check_values

_TYPES = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")
_STORAGE = (".db3", ".mcap")
_MAX_METADATA = 500_000  # bytes


class BagReader(Reader):
    """Bags of JointState messages."""

    title = "ROS bag"
    suffixes = (*_STORAGE, ".bag")

    def recognises(self, path: Path) -> bool:
        """Files by their suffix; folders that hold a rosbag2."""
        if path.is_dir():
            return (path / "metadata.yaml").is_file() or bool(_stored(path))
        return super().recognises(path)

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The bag's only run: one topic of JointState, in the order of its stamps."""
        _require_rosbags()
        check_bag(path)
        try:
            with ExitStack() as stack:
                readers = [stack.enter_context(reader) for reader in _readers(path)]
                run = _collect(path, readers, wanted).run(path, wanted)
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


def _require_rosbags() -> None:
    try:
        import rosbags.rosbag2  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            "Reading ROS bags needs the library rosbags: pip install 'excite-cli[bags]'"
        ) from error


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


def _collect(path: Path, readers: list[Any], wanted: ReadOptions) -> JointStates:
    from rosbags.typesys import Stores, get_typestore

    first = path.suffix == ".bag" and not path.is_dir()
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    decode = store.deserialize_ros1 if first else store.deserialize_cdr
    connections = [c for reader in readers for c in reader.connections if c.msgtype in _TYPES]
    topic = _topic(path, readers, {c.topic: c for c in connections}, wanted)
    check_values(path, 20 * sum(c.msgcount for c in connections if c.topic == topic))
    states = JointStates(topic)
    for stamp, data in _messages(readers, topic):
        states.add(int(stamp), decode(data, _TYPES[0]))
    return states


def _messages(readers: list[Any], topic: str) -> Iterator[tuple[int, Any]]:
    for reader in readers:
        chosen = [c for c in reader.connections if c.topic == topic and c.msgtype in _TYPES]
        if chosen:
            for _, stamp, data in reader.messages(connections=chosen):
                yield stamp, data


def _topic(path: Path, readers: list[Any], states: dict[str, Any], wanted: ReadOptions) -> str:
    topics = sorted(states)
    if wanted.topic is not None:
        if wanted.topic in topics:
            return wanted.topic
        hint = nearest(wanted.topic, topics)
        raise FileError(
            f"{path} has no JointState topic '{wanted.topic}' (measurement.topic).{hint} "
            f"It has: {', '.join(topics) or 'none'}."
        )
    if not topics:
        there = sorted({f"{c.topic} ({c.msgtype})" for r in readers for c in r.connections})
        raise FileError(
            f"{path} has no topic of type sensor_msgs/JointState; it has: "
            f"{', '.join(there[:20]) or 'no topics'}."
        )
    if len(topics) > 1:
        counts = ", ".join(f"{topic} ({states[topic].msgcount} messages)" for topic in topics)
        raise FileError(
            f"{path} has several JointState topics: {counts}. Name one: measurement.topic: "
            f"{topics[0]}"
        )
    return topics[0]


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
