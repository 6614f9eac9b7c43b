"""ROS bags: spoiled samples, databases, records and bytes of rosbag2 (both storages) and ROS 1.

Valid bags are made with the library's writers once; inputs are copies, changed in the database, in
the messages, in the metadata or anywhere.
"""

import contextlib
import shutil
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trust.fuzz_mutations import (
    Rng,
    chance,
    odd_number,
    odd_text,
    pick,
    spoiled_bytes,
    spoiled_text,
)
from benchmarks.trust.fuzz_recordings import JOINTS, enter_data, enter_motion, recorded
from benchmarks.trust.fuzz_trial import Fuzzer

_JOINT_STATE = "sensor_msgs/msg/JointState"
_EPOCH = 1_700_000_000_000_000_000
_TYPES = (
    _JOINT_STATE,
    "sensor_msgs/msg/Image",
    "std_msgs/msg/String",
    "x",
    "",
    "a/b/c/d",
    "trajectory_msgs/msg/JointTrajectory",
    "sensor_msgs/JointState",
)


class BagFuzzer(Fuzzer):
    """ROS bags."""

    name = "bags"

    def prepare(self, bases: Path) -> None:
        """A bag of each storage."""
        from rosbags.rosbag2 import StoragePlugin

        if (bases / "ros1.bag").is_file():
            return
        for name, storage in (("sqlite", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
            shutil.rmtree(bases / name, ignore_errors=True)
            _write2(bases / name, storage)
        _write1(bases / "ros1.bag")

    def open(self, bases: Path) -> None:
        """The bags' bytes."""
        self._folders = (bases / "sqlite", bases / "mcap")
        self._files = [f for d in self._folders for f in d.iterdir() if f.suffix != ".yaml"]
        self._files.append(bases / "ros1.bag")
        self._database = next(file for file in self._files if file.suffix == ".db3")
        self._data = {file: file.read_bytes() for file in self._files}

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled bag: a file alone, or a folder with its metadata."""
        way = int(rng.integers(20))
        if way < 8:
            file = pick(rng, self._files)
            path = folder / f"log{file.suffix}"
            path.write_bytes(spoiled_bytes(rng, self._data[file], int(pick(rng, (1, 2, 5, 30)))))
            return path, f"bytes of {file.suffix}"
        if way < 13:
            path = folder / "log.db3"
            path.write_bytes(self._data[self._database])
            return path, f"database {_database(rng, path)}"
        if way < 17:
            path = folder / "log"
            shutil.copytree(pick(rng, self._folders), path)
            return path, _metadata(rng, path)
        if way == 17:
            file = pick(rng, self._files)
            path = folder / f"log{file.suffix}"
            size = int(rng.integers(len(self._data[file]) + 1))
            path.write_bytes(self._data[file][:size])
            return path, f"cut {file.suffix}"
        path = folder / f"log{pick(rng, ('.db3', '.mcap', '.bag'))}"
        heads = (b"SQLite format 3\0", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n", b"")
        path.write_bytes(pick(rng, heads) + rng.bytes(int(rng.integers(3000))))
        return path, "binary"

    def enter(self, path: Path) -> None:
        """As measured data, or as a motion."""
        if not enter_motion(path):
            enter_data(path)


def _states() -> Any:
    data = recorded(np.random.default_rng(0), 60)
    for k, t in enumerate(data["t"]):
        yield k, _EPOCH + round(t * 1e9), data["q"][k], data["dq"][k], data["tau"][k]


def _message(store: Any, k: int, stamp: int, first: bool, values: Any) -> Any:
    types = store.types
    more = {"seq": k} if first else {}
    time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    header = types["std_msgs/msg/Header"](stamp=time, frame_id="", **more)
    return types[_JOINT_STATE](header, list(JOINTS), *values)


def _write2(path: Path, storage: Any) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connection = writer.add_connection("/joint_states", _JOINT_STATE, typestore=store)
        for k, stamp, *values in _states():
            message = _message(store, k, stamp, False, values)
            writer.write(connection, stamp, store.serialize_cdr(message, _JOINT_STATE))


def _write1(path: Path) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    path.unlink(missing_ok=True)
    with Writer(path) as writer:
        connection = writer.add_connection("/joint_states", _JOINT_STATE, typestore=store)
        for k, stamp, *values in _states():
            message = _message(store, k, stamp, True, values)
            writer.write(connection, stamp, store.serialize_ros1(message, _JOINT_STATE))


def _database(rng: Rng, path: Path) -> str:
    """Rows and tables of sqlite changed; messages with wrong lengths and garbage."""
    way = int(rng.integers(8))
    with sqlite3.connect(path, isolation_level=None) as database:
        if way <= 2:
            for number in rng.integers(1, 61, int(pick(rng, (1, 5, 60)))).tolist():
                row = database.execute("SELECT data FROM messages WHERE id=?", (number,)).fetchone()
                data = _message_spoiled(rng, row[0] if row else b"")
                database.execute("UPDATE messages SET data=? WHERE id=?", (data, number))
            made = "messages"
        elif way == 3:
            stamps = (0, -1, 2**62, -(2**63), 2**63 - 1, 1.5, "x", None)
            number = int(rng.integers(1, 61))
            _try(
                database, "UPDATE messages SET timestamp=? WHERE id>=?", (pick(rng, stamps), number)
            )
            made = "stamps"
        elif way == 4:
            name, value = (
                pick(rng, ("type", "name", "serialization_format", "offered_qos_profiles")),
                pick(rng, (pick(rng, _TYPES), odd_text(rng), None, 3, b"x")),
            )
            _try(database, f"UPDATE topics SET {name}=?", (value,))
            made = "topics"
        elif way == 5:
            table = pick(rng, ("messages", "topics", "metadata", "schema", "message_definitions"))
            _try(database, f"DROP TABLE {table}")
            made = "dropped table"
        elif way == 6:
            values = ("text", 5, None, 1.5, b"", "x" * 10_000)
            _try(database, "UPDATE messages SET data=?", (pick(rng, values),))
            made = "message types"
        else:
            _try(
                database,
                pick(
                    rng,
                    (
                        "INSERT INTO topics SELECT id+1, '/other', type, serialization_format, "
                        "offered_qos_profiles, '' FROM topics",
                        "DELETE FROM messages",
                        "DELETE FROM topics",
                        "UPDATE messages SET topic_id=99",
                        "CREATE VIEW v AS SELECT * FROM messages, messages",
                        "UPDATE schema SET schema_version=9",
                        "UPDATE schema SET schema_version='x'",
                        "UPDATE topics SET id=-1",
                        "CREATE TRIGGER t AFTER INSERT ON topics BEGIN DELETE FROM messages; END",
                    ),
                ),
            )
            made = "tables"
    database.close()
    return made


def _try(database: Any, command: str, values: tuple[Any, ...] = ()) -> None:
    # The database itself may refuse to hold it.
    with contextlib.suppress(sqlite3.Error, OverflowError, UnicodeEncodeError):
        database.execute(command, values)


def _message_spoiled(rng: Rng, data: bytes) -> bytes:
    raw = bytearray(data)
    way = int(rng.integers(4))
    if way == 0 and len(raw) > 32:
        # A length in the message claims more than is there.
        at = 4 * int(rng.integers(1, len(raw) // 4))
        raw[at : at + 4] = int(pick(rng, (2**31, 2**32 - 1, 2**24, 5, 0))).to_bytes(4, "little")
        return bytes(raw)
    if way == 1 and len(raw) > 32:
        at = len(raw) - 8 * int(rng.integers(1, 10))
        raw[at : at + 8] = np.float64(odd_number(rng) if chance(rng, 0.9) else 1.0).tobytes()
        return bytes(raw)
    return spoiled_bytes(rng, data)


def _metadata(rng: Rng, path: Path) -> str:
    file = path / "metadata.yaml"
    text = file.read_bytes()
    way = int(rng.integers(5))
    if way == 0:
        file.write_bytes(spoiled_bytes(rng, text))
    elif way == 1:
        store = next(f.name for f in path.iterdir() if f.suffix != ".yaml")
        other = pick(
            rng,
            (
                "../../../etc/passwd",
                "/etc/passwd",
                "/dev/zero",
                ".",
                "",
                "metadata.yaml",
                odd_text(rng),
            ),
        )
        file.write_bytes(text.replace(store.encode(), other.encode("utf-8", "replace")))
    elif way == 2:
        level = b"a: &a [x, x, x, x, x, x, x, x, x]\n"
        for k in range(9):
            level += b"%c: &%c [%s]\n" % (98 + k, 98 + k, b", ".join([b"*%c" % (97 + k)] * 9))
        file.write_bytes(level + text)
        return "metadata bomb"
    elif way == 3:
        file.write_bytes(
            pick(
                rng,
                (b"", b"[" * 5000, b"a: " * 5000, b"!!python/object/apply:os.system [id]", b"\0"),
            )
        )
    else:
        file.write_bytes(
            spoiled_text(rng, text, (b"zstd", b"file", b"message", b"sqlite3", b"mcap", b"-1"))
        )
    return "metadata"
