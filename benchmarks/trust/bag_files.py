"""ROS bags of rosbag2 (both storages) and ROS 1: databases, messages, metadata and bytes."""

import contextlib
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trust.data_files import JOINTS, OfRecording, recorded
from benchmarks.trust.mutations import Rng, odd_number, odd_text, pick, spoiled_bytes, spoiled_text

_JOINT_STATE = "sensor_msgs/msg/JointState"
_EPOCH = 1_700_000_000_000_000_000
_MAGIC = (b"SQLite format 3\0", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n", b"")


class BagFuzzer(OfRecording):
    """Bags: a file alone, or a folder with its metadata."""

    name = "bags"

    def prepare(self, bases: Path) -> None:
        """A bag of each storage."""
        from rosbags import rosbag1, rosbag2
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.typesys import Stores, get_typestore

        for name, storage in (("sqlite", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
            store = get_typestore(Stores.ROS2_HUMBLE)
            with rosbag2.Writer(bases / name, version=9, storage_plugin=storage) as writer:
                _play(writer, store, store.serialize_cdr, first=False)
        store = get_typestore(Stores.ROS1_NOETIC)
        with rosbag1.Writer(bases / "ros1.bag") as writer:
            _play(writer, store, store.serialize_ros1, first=True)

    def open(self, bases: Path) -> None:
        """The bags' bytes."""
        self._folders = (bases / "sqlite", bases / "mcap")
        self._files = [f for d in self._folders for f in d.iterdir() if f.suffix != ".yaml"]
        self._files.append(bases / "ros1.bag")

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled bag."""
        way, file = int(rng.integers(20)), pick(rng, self._files)
        if way < 9:
            path, data = folder / f"log{file.suffix}", file.read_bytes()
            cut = data[: int(rng.integers(len(data) + 1))]
            path.write_bytes(spoiled_bytes(rng, data, pick(rng, (1, 2, 5, 30))) if way < 8 else cut)
            return path, f"{'bytes of' if way < 8 else 'cut'} {file.suffix}"
        if way < 14:
            (database,) = (f for f in self._files if f.suffix == ".db3")
            path = Path(shutil.copy(database, folder / "log.db3"))
            return path, f"database {_spoil_database(rng, path)}"
        path = folder / "log"
        if way < 18:
            shutil.copytree(pick(rng, self._folders), path)
            _spoil_metadata(rng, path)
            return path, "metadata"
        path = path.with_suffix(pick(rng, (".db3", ".mcap", ".bag")))
        path.write_bytes(pick(rng, _MAGIC) + rng.bytes(int(rng.integers(3000))))
        return path, "binary"


def _play(writer: Any, store: Any, serialize: Callable[..., Any], first: bool) -> None:
    """Write the messages of a motion; `first`: as ROS 1 has them."""
    types, data = store.types, recorded(np.random.default_rng(0), 60)
    connection = writer.add_connection("/joint_states", _JOINT_STATE, typestore=store)
    for k, t in enumerate(data["t"]):
        stamp = _EPOCH + round(t * 1e9)
        time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
        number = {"seq": k} if first else {}
        header = types["std_msgs/msg/Header"](stamp=time, frame_id="", **number)
        values = (data[name][k] for name in ("q", "dq", "tau"))
        message = types[_JOINT_STATE](header, list(JOINTS), *values)
        writer.write(connection, stamp, serialize(message, _JOINT_STATE))


# Each is run once; `?` is an odd value.
_STATEMENTS = (
    *("UPDATE messages SET data=?", "UPDATE messages SET timestamp=? WHERE id>=20"),
    *(f"UPDATE topics SET {x}=?" for x in ("type", "name", "serialization_format", "id")),
    *("UPDATE topics SET offered_qos_profiles=?", "UPDATE schema SET schema_version=?"),
    *(f"DROP TABLE {x}" for x in ("messages", "topics", "metadata", "schema")),
    *("DELETE FROM messages", "DELETE FROM topics", "UPDATE messages SET topic_id=99"),
    "INSERT INTO topics SELECT id+1, '/other', type, serialization_format, "
    "offered_qos_profiles, '' FROM topics",
    "CREATE VIEW v AS SELECT * FROM messages, messages",
    "CREATE TRIGGER t AFTER INSERT ON topics BEGIN DELETE FROM messages; END",
)
_VALUES = (0, -1, 9, 2**62, -(2**63), 2**63 - 1, 1.5, "x", "x" * 10_000, b"", b"x", None,
           "sensor_msgs/msg/Image", "std_msgs/msg/String", "a/b/c/d", "sensor_msgs/JointState",
           "trajectory_msgs/msg/JointTrajectory")  # fmt: skip


def _spoil_database(rng: Rng, path: Path) -> str:
    """Rows and tables of sqlite changed, or messages with wrong lengths and garbage."""
    database = sqlite3.connect(path, isolation_level=None)
    statement = pick(rng, ("messages",) * len(_STATEMENTS) + _STATEMENTS)
    # The database itself may refuse to hold it.
    with contextlib.suppress(sqlite3.Error, OverflowError, UnicodeEncodeError):
        if statement != "messages":
            value = pick(rng, (*_VALUES, odd_text(rng)))
            database.execute(statement, (value,) * statement.count("?"))
        for number in rng.integers(1, 61, pick(rng, (1, 5, 60))).tolist():
            row = database.execute("SELECT data FROM messages WHERE id=?", (number,)).fetchone()
            if statement == "messages" and row:
                data = _spoiled_message(rng, row[0])
                database.execute("UPDATE messages SET data=? WHERE id=?", (data, number))
    database.close()
    return str(statement)


def _spoiled_message(rng: Rng, data: bytes) -> bytes:
    """A length that claims more than is there, an odd number, or spoiled bytes."""
    raw, way = bytearray(data), int(rng.integers(4))
    if way > 1 or len(raw) <= 80:
        return spoiled_bytes(rng, data)
    if way == 0:
        at = 4 * int(rng.integers(1, len(raw) // 4))
        raw[at : at + 4] = int(pick(rng, (2**31, 2**32 - 1, 2**24, 5, 0))).to_bytes(4, "little")
    else:
        at = len(raw) - 8 * int(rng.integers(1, 10))
        raw[at : at + 8] = np.float64(odd_number(rng)).tobytes()
    return bytes(raw)


_WORDS = b"zstd file message sqlite3 mcap -1 [ a: &a *a !!python/object/apply:os.system \0".split()
_FILES = b"../../../etc/passwd /etc/passwd /dev/zero . metadata.yaml".split()


def _spoil_metadata(rng: Rng, path: Path) -> None:
    file = path / "metadata.yaml"
    text, way = file.read_bytes(), int(rng.integers(3))
    if way == 0:
        text = spoiled_bytes(rng, text)
    elif way == 1:
        text = spoiled_text(rng, text, _WORDS)
    else:
        store = next(f.name for f in path.iterdir() if f.suffix != ".yaml").encode()
        odd = odd_text(rng).encode("utf-8", "replace")
        text = text.replace(store, pick(rng, (*_FILES, b"", odd)))
    file.write_bytes(text)
