"""ROS bags: written with the library, read without ROS, damaged on purpose."""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from excite_cli.errors import FileError, MissingExtraError
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import Origin
from tests.measurement.recordings import JOINTS, only, read, recorded

EPOCH = 1_700_000_000_000_000_000
STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE1 = get_typestore(Stores.ROS1_NOETIC)


def _message(
    store: Any, run: Run, k: int, names: Sequence[str], stamp: int, fields: Sequence[str]
) -> Any:
    types = store.types
    time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    arguments = {"stamp": time, "frame_id": ""}
    if store is STORE1:
        arguments["seq"] = k
    order = [JOINTS.index(name) if name in JOINTS else 0 for name in names]
    parts = {"position": run.q, "velocity": run.dq, "effort": run.tau}
    values = {f: parts[f][k, order] if f in fields else np.zeros(0) for f in parts}
    header = types["std_msgs/msg/Header"](**arguments)
    return types["sensor_msgs/msg/JointState"](header, list(names), **values)


def write_bag(
    path: Path,
    run: Run,
    storage: StoragePlugin = StoragePlugin.SQLITE3,
    topics: Sequence[str] = ("/joint_states",),
    names: Sequence[Sequence[str]] = (JOINTS,),
    fields: Sequence[str] = ("position", "velocity", "effort"),
    stamped: bool = True,
) -> Path:
    """A rosbag2 folder; lists of `names` alternate from message to message."""
    with Writer(path, version=9, storage_plugin=storage) as writer:
        kind = "sensor_msgs/msg/JointState"
        connections = [writer.add_connection(topic, kind, typestore=STORE) for topic in topics]
        for k in range(len(run.t)):
            stamp = EPOCH + round(run.t[k] * 1e9)
            for connection in connections:
                header = stamp if stamped else 0
                message = _message(STORE, run, k, names[k % len(names)], header, fields)
                writer.write(connection, stamp + 777, STORE.serialize_cdr(message, kind))
    return path


@pytest.fixture
def run() -> Run:
    return recorded(2.0)


def same(back: Run, run: Run) -> None:
    for name in ("q", "dq", "tau"):
        np.testing.assert_array_equal(getattr(back, name), getattr(run, name))
    np.testing.assert_allclose(back.t, run.t, rtol=0, atol=1e-9)  # whole nanoseconds


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("part", ["folder", "file", "folder without metadata", "file alone"])
def test_rosbag2(tmp_path: Path, run: Run, storage: StoragePlugin, part: str) -> None:
    path = write_bag(tmp_path / "log", run, storage)
    if part in ("folder without metadata", "file alone"):
        (path / "metadata.yaml").unlink()
    file = next(f for f in path.iterdir() if f.suffix in (".db3", ".mcap"))
    if part == "file alone":
        file = Path(shutil.move(file, tmp_path / file.name))
    data = read(path if "folder" in part else file)
    assert data.findings == ()
    assert data.runs[0].name == "log"
    same(data.runs[0], run)
    origin = Origin(str(path if "folder" in part else file), "/joint_states")
    assert data.runs[0].origin == origin
    assert data.runs[0].epoch == pytest.approx(EPOCH * 1e-9 + run.t[0], abs=1e-6)


def test_ros1(tmp_path: Path, run: Run) -> None:
    path = tmp_path / "log.bag"
    kind = "sensor_msgs/msg/JointState"
    with Writer1(path) as writer:
        connection = writer.add_connection("/joint_states", kind, typestore=STORE1)
        for k in range(len(run.t)):
            stamp = EPOCH + round(run.t[k] * 1e9)
            message = _message(STORE1, run, k, JOINTS, stamp, ("position", "velocity", "effort"))
            writer.write(connection, stamp, STORE1.serialize_ros1(message, kind))
    same(read(path).runs[0], run)
    path.write_bytes(path.read_bytes()[:20_000])
    with pytest.raises(FileError, match=r"damaged or cut off bag.*rosbag reindex"):
        read(path)


def test_changing_order_is_matched_by_name(tmp_path: Path, run: Run) -> None:
    path = write_bag(tmp_path / "log", run, names=(JOINTS, JOINTS[::-1]))
    data = read(path)
    only(data.findings, "order")
    same(data.runs[0], run)


def test_other_drivers_on_the_topic(tmp_path: Path, run: Run) -> None:
    path = write_bag(tmp_path / "log", run, names=(JOINTS, ("gripper",)))
    data = read(path)
    found = only(data.findings, "left_out")
    assert "200 messages of gripper" in found.text
    np.testing.assert_array_equal(data.runs[0].q, run.q[::2])


def test_joints_spread_over_messages(tmp_path: Path, run: Run) -> None:
    path = write_bag(tmp_path / "log", run, names=(JOINTS[:2], JOINTS[2:]))
    with pytest.raises(FileError, match=r"spreads.*shoulder, elbow; wrist.*joint_state_publisher"):
        read(path)


def test_several_topics(tmp_path: Path, run: Run) -> None:
    path = write_bag(tmp_path / "log", run, topics=("/a", "/b"))
    with pytest.raises(FileError, match=r"/a \(400 messages\), /b.*measurement.topic: /a"):
        read(path)
    same(read(path, topic="/b").runs[0], run)
    with pytest.raises(FileError, match="no JointState topic '/c'"):
        read(path, topic="/c")


def test_no_joint_states(tmp_path: Path) -> None:
    with Writer(tmp_path / "log", version=9) as writer:
        kind = "std_msgs/msg/String"
        connection = writer.add_connection("/words", kind, typestore=STORE)
        writer.write(connection, 1, STORE.serialize_cdr(STORE.types[kind]("x"), kind))
    with pytest.raises(FileError, match=r"no topic of type.*/words \(std_msgs/msg/String\)"):
        read(tmp_path / "log")


def test_empty_fields(tmp_path: Path, run: Run) -> None:
    path = write_bag(tmp_path / "a", run, fields=("position", "effort"))
    assert read(path).runs[0].dq is None
    path = write_bag(tmp_path / "b", run, fields=("position", "velocity"))
    with pytest.raises(FileError, match="carry no effort"):
        read(path)


def test_empty_stamps_fall_back_to_the_time_of_recording(tmp_path: Path, run: Run) -> None:
    data = read(write_bag(tmp_path / "log", run, stamped=False))
    only(data.findings, "stamps")
    same(data.runs[0], run)


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9])
def test_truncated(tmp_path: Path, run: Run, storage: StoragePlugin, share: float) -> None:
    folder = write_bag(tmp_path / "log", run, storage)
    file = next(f for f in folder.iterdir() if f.suffix in (".db3", ".mcap"))
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    for path in (file, folder):
        with pytest.raises(FileError, match="damaged or cut off bag") as caught:
            read(path)
        assert str(path) in str(caught.value)


def test_noise_in_place_of_a_bag(tmp_path: Path) -> None:
    for suffix in (".db3", ".mcap", ".bag"):
        path = tmp_path / f"noise{suffix}"
        path.write_bytes(np.random.default_rng(0).bytes(5000))
        with pytest.raises(FileError, match="damaged or cut off bag"):
            read(path)


def test_recorder_not_closed(tmp_path: Path, run: Run) -> None:
    folder = write_bag(tmp_path / "log", run)
    file = folder / "log.db3"
    (folder / "log.db3-wal").write_bytes(b"pending")
    assert only(read(file).findings, "truncated").severity == "warning"


def test_library_missing(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_bag(tmp_path / "log", run)
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[bags\]'"):
        read(path)
