"""Files and folders old or new, never between, whatever the file system refuses."""

import errno
import os
import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from excite_cli import atomic
from excite_cli.atomic import write_atomically, write_folder_atomically
from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.errors import FileError
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.motion_formats.catalogue import MOTION_FORMATS
from excite_cli.motion_formats.timed_motion import TimedMotion

WRITERS = pytest.mark.parametrize("write", [write_atomically, write_folder_atomically])
Writer = Callable[[Path, Callable[[Path], None]], None]


def bag(text: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        folder.mkdir()
        (folder / "metadata.yaml").write_text(text)

    return make


@WRITERS
@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "no space is left on the disk. Free"),
        (OSError("Can't write data (errno = 28, error message = 'No …')"), "no space is left"),
        (OSError(errno.EDQUOT, "Disk quota exceeded"), "quota is used up"),
        (OSError("something odd"), "something odd"),
    ],
    ids=["full", "full-hdf5", "quota", "odd"],
)
def test_a_refusal_is_one_message_and_leaves_nothing(
    write: Writer, error: OSError, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "out"

    def fail(temporary: Path) -> None:
        if write is write_folder_atomically:
            bag("half")(temporary)
        raise error

    with pytest.raises(FileError, match=f"{path} cannot be written: .*{words}"):
        write(path, fail)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("one_step", [True, False], ids=["exchange", "two-renames"])
def test_a_folder_takes_the_place_of_another(
    one_step: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> None:
        raise AssertionError("there would be an instant without a bag")

    write_folder_atomically(tmp_path / "bag", bag("old"))
    if one_step:
        monkeypatch.setattr(atomic.os, "replace", never)
    else:
        monkeypatch.setattr(atomic.ctypes, "CDLL", lambda *_, **__: object())
    write_folder_atomically(tmp_path / "bag", bag("new"))
    assert (tmp_path / "bag" / "metadata.yaml").read_text() == "new"
    assert [each.name for each in tmp_path.iterdir()] == ["bag"]


def test_all_is_on_the_disk_before_it_is_in_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[str] = []
    replace = os.replace
    monkeypatch.setattr(
        atomic.os, "replace", lambda old, new: (steps.append("replace"), replace(old, new))
    )
    monkeypatch.setattr(atomic, "_to_disk", lambda path: steps.append(path.name[-5:]))
    write_atomically(tmp_path / "out", lambda file: file.write_text("1"))
    assert steps == [".part", "replace", tmp_path.name[-5:]]


def test_a_link_stays_and_devices_and_folders_are_never_replaced(tmp_path: Path) -> None:
    def write(name: str) -> None:
        write_atomically(tmp_path / name, lambda file: file.write_text("1"))

    (tmp_path / "far").mkdir()
    (tmp_path / "out.h5").symlink_to(tmp_path / "far" / "real.h5")
    write("out.h5")
    assert (tmp_path / "out.h5").is_symlink()
    assert (tmp_path / "far" / "real.h5").read_text() == "1"
    os.mkfifo(tmp_path / "pipe")
    for name, words in (("pipe", "not a regular file"), ("far", "is a folder")):
        with pytest.raises(FileError, match=words):
            write(name)
    assert (tmp_path / "pipe").is_fifo()


def test_a_cache_that_cannot_be_written_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    key, arrays = "k" * 32, {"a": np.ones(3)}
    (tmp_path / "excite").write_text("a file in the place of the folder")
    store_arrays(key, arrays)
    assert stored_arrays(key) is None
    (tmp_path / "excite").unlink()
    store_arrays(key, arrays)
    found = stored_arrays(key)
    assert found is not None
    assert found["a"].tolist() == [1.0, 1.0, 1.0]
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", "/nonexistent/home")
    store_arrays(key, arrays)  # nor is a home that is not there


def test_a_bag_that_fills_the_disk_is_told_as_any_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = pytest.importorskip("rosbags.rosbag2").Writer

    def full(*_: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr(writer, "write", full)
    t = np.arange(5.0)
    motion = TimedMotion("m", ("a",), t, np.zeros((5, 1)), np.zeros((5, 1)), np.zeros((5, 1)))
    with pytest.raises(FileError, match="bag cannot be written: no space is left on the disk"):
        MOTION_FORMATS.members["rosbag2"]().write(tmp_path / "bag", motion)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_fails_once_for_an_hdf5_file(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(OSError, match="No space left"), new_hdf5(Path("/dev/full")) as file:
        file["zeros"] = [0.0] * 1000
    assert capfd.readouterr().err == ""
