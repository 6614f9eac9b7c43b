"""ROS bags: written with the library, read without ROS, damaged on purpose."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from excite_cli.errors import FileError, MissingExtraError
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import Origin
from tests.measurement.bags import EPOCH, write_bag
from tests.measurement.recordings import JOINTS, only, read, recorded, refused

RUN = recorded(2.0)
STORAGES = pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])


def same(back: Run) -> None:
    for name in ("q", "dq", "tau"):
        np.testing.assert_array_equal(getattr(back, name), getattr(RUN, name))
    np.testing.assert_allclose(back.t, RUN.t, rtol=0, atol=1e-9)  # whole nanoseconds


def file_of(folder: Path) -> Path:
    return next(file for file in folder.iterdir() if file.suffix in (".db3", ".mcap"))


@STORAGES
@pytest.mark.parametrize("part", ["folder", "file", "folder without metadata", "file alone"])
def test_rosbag2(tmp_path: Path, storage: StoragePlugin, part: str) -> None:
    path = write_bag(tmp_path / "log", RUN, storage)
    if part in ("folder without metadata", "file alone"):
        (path / "metadata.yaml").unlink()
    file = file_of(path)
    if part == "file alone":
        file = Path(shutil.move(file, tmp_path / file.name))
    asked = path if "folder" in part else file
    data = read(asked)
    assert data.findings == ()
    (run,) = data.runs
    assert (run.name, run.origin) == ("log", Origin(str(asked), "/joint_states"))
    assert run.epoch == pytest.approx(EPOCH * 1e-9 + RUN.t[0], abs=1e-6)
    same(run)


def test_ros1(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "log.bag", RUN)
    same(read(path).runs[0])
    path.write_bytes(path.read_bytes()[:20_000])
    with pytest.raises(FileError, match=r"damaged or cut off bag.*rosbag reindex"):
        read(path)


def test_joints_are_matched_by_name_and_other_drivers_left_out(tmp_path: Path) -> None:
    data = read(write_bag(tmp_path / "a", RUN, names=(JOINTS, JOINTS[::-1])))
    only(data.findings, "order")
    same(data.runs[0])
    data = read(write_bag(tmp_path / "b", RUN, names=(JOINTS, ("gripper",))))
    assert "200 messages of gripper" in only(data.findings, "left_out").text
    np.testing.assert_array_equal(data.runs[0].q, RUN.q[::2])
    path = write_bag(tmp_path / "c", RUN, names=(JOINTS[:2], JOINTS[2:]))
    with pytest.raises(FileError, match=r"spreads.*shoulder, elbow; wrist.*joint_state_publisher"):
        read(path)


def test_several_topics_and_none(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "log", RUN, topics=("/a", "/b"))
    with pytest.raises(FileError, match=r"/a \(400 messages\), /b.*measurement.topic: /a"):
        read(path)
    same(read(path, topic="/b").runs[0])
    refused(path, "no JointState topic '/c'", topic="/c")
    kind, store = "std_msgs/msg/String", get_typestore(Stores.ROS2_HUMBLE)
    with Writer(tmp_path / "words", version=9) as writer:
        connection = writer.add_connection("/words", kind, typestore=store)
        writer.write(connection, 1, store.serialize_cdr(store.types[kind]("x"), kind))
    refused(tmp_path / "words", "no topic of type", "/words (std_msgs/msg/String)")


def test_empty_fields_and_stamps(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a", RUN, fields=("position", "effort"))
    assert read(path).runs[0].dq is None
    refused(write_bag(tmp_path / "b", RUN, fields=("position", "velocity")), "carry no effort")
    data = read(write_bag(tmp_path / "log", RUN, stamped=False))  # the time of recording counts
    only(data.findings, "stamps")
    same(data.runs[0])


@STORAGES
@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9])
def test_truncated(tmp_path: Path, storage: StoragePlugin, share: float) -> None:
    folder = write_bag(tmp_path / "log", RUN, storage)
    file = file_of(folder)
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    for path in (file, folder):
        refused(path, "damaged or cut off bag")


@pytest.mark.parametrize("suffix", [".db3", ".mcap", ".bag"])
def test_noise_in_place_of_a_bag(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"noise{suffix}"
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    refused(path, "damaged or cut off bag")


def test_recorder_not_closed_and_library_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = write_bag(tmp_path / "log", RUN)
    (folder / "log.db3-wal").write_bytes(b"pending")
    assert only(read(folder / "log.db3").findings, "truncated").severity == "warning"
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[bags\]'"):
        read(folder)
