"""Measured data, motions and results made to read other files, to fill memory or to crash."""

import gzip
import itertools
import json
import shutil
import sqlite3
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from benchmarks.trust.bag_files import BagFuzzer
from benchmarks.trust.data_files import JOINTS, recorded
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement import reader
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.motion_formats.catalogue import read_motion
from excite_cli.store.result_file import read_result
from tests.trust.refusals import refused

HEADER = "t," + ",".join(f"{c}_{j}" for c in ("q", "tau") for j in JOINTS)


def read(path: Path) -> Any:
    return read_dataset([path], MeasurementSpec(), JOINTS)


def motion(path: Path) -> Any:
    return read_motion(path, JOINTS)


def measured(path: Path, change: Callable[[h5py.File], None]) -> Path:
    with h5py.File(path, "w") as file:
        for name, array in recorded(np.random.default_rng(0)).items():
            file[name] = array
        file.attrs["joint_names"] = list(JOINTS)
        change(file)
    return path


def huge(rows: int, filled: bool = False) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        for name, shape in (("t", (rows,)), ("q", (rows, 3)), ("tau", (rows, 3))):
            del file[name]
            if filled:
                file.create_dataset(name, data=np.zeros(shape), compression="gzip", chunks=True)
            else:
                file.create_dataset(name, shape=shape, dtype="f8", chunks=True)

    return change


def test_hdf5_without_storage_or_of_packed_zeros(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "claims to hold" in refused(read, measured(tmp_path / "log.h5", huge(2**24)))
    monkeypatch.setattr(reader, "ALWAYS", 2**20)
    path = measured(tmp_path / "log.h5", huge(100_000, filled=True))
    assert "claims to hold" in refused(read, path)


def looped(file: h5py.File) -> None:
    group = file.create_group("motions")
    group["again"] = group


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda file: file.__setitem__("stack", h5py.ExternalLink("/etc/passwd", "/")), "a link"),
        (lambda file: file.create_dataset("x", (10**12,), "f8", chunks=True), "claims to hold"),
        (looped, "round in a circle"),
    ],
    ids=["external link", "1e12 values", "loop"],
)
def test_results(change: Callable[[h5py.File], None], word: str, tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    with h5py.File(path, "w") as file:  # the beginning of a result file, with something in it
        file.attrs.update({"program": "excite", "schema": 1})
        change(file)
    assert word in refused(read_result, path)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (",".join(f"q_{k}" for k in range(100_000)) + "\n1", "no whole rows"),
        ("q_1," * 100_000 + "\n1", "is there twice"),
        (HEADER + "\n" + "1e400,0,0,0,0,0,0\n" * 30, "nothing is left"),
        (HEADER + "\n" + "\n".join(f"{k}e-300,0,0,0,0,0,0" for k in range(30)), "no clock"),
        (HEADER + "\n" + "\0" * 1000, "log.csv"),
    ],
    ids=["wide", "doubled", "infinite", "tiny steps", "NUL"],
)
def test_csv(text: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    assert word in refused(read, path)


def test_csv_packed_zeros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "ALWAYS", 2**20)
    path = tmp_path / "log.csv.gz"
    with gzip.open(path, "wb", compresslevel=9) as file:
        file.write(HEADER.encode() + b"\n")
        for _ in range(4):
            file.write(b"0,0,0,0,0,0,0\n" * 70_000)
    assert "claims to hold" in refused(read, path)


def test_stamps_that_would_need_millions_of_samples_between_them(tmp_path: Path) -> None:
    t = np.concatenate([np.arange(60) * 1e-9 + 0.019 * k for k in range(40)])  # every 1 ns, or not
    rows = "\n".join(f"{x!r},0,0,0,0,0,0" for x in t.tolist())
    path = tmp_path / "log.csv"
    path.write_text(f"{HEADER}\n{rows}\n", encoding="utf-8")
    with pytest.raises(FileError, match="follow each other within 1e-09 s"):
        read(path)


def bag(folder: Path) -> tuple[Path, Path]:
    """A rosbag2 folder of sqlite, and its file."""
    BagFuzzer().prepare(folder)
    path = folder / "sqlite"
    return path, next(file for file in path.iterdir() if file.suffix == ".db3")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (
            "a: &a [x, x, x]\n" + "".join(
                f"{name}: &{name} [{', '.join([f'*{last}'] * 9)}]\n"
                for last, name in itertools.pairwise("abcdefghij")
            ),
            "aliases",
        ),
        ("[" * 50_000, "nested deeper"),
        ("", "damaged"),
    ],
    ids=["bomb", "deep", "a file elsewhere"],
)  # fmt: skip
def test_bag_with_hostile_metadata(text: str, word: str, tmp_path: Path) -> None:
    path, file = bag(tmp_path)
    metadata = path / "metadata.yaml"
    elsewhere = metadata.read_text(encoding="utf-8").replace(file.name, "/dev/zero")
    metadata.write_text(text or elsewhere, encoding="utf-8")
    assert word in refused(read, path)


@pytest.mark.parametrize(
    "command",
    [
        "UPDATE messages SET data=x'0001000000000000ffffffffffffffffffffffff'",
        "UPDATE messages SET data='text'",
        "UPDATE messages SET timestamp='x'",
        "DROP TABLE messages",
    ],
)
def test_bag_with_a_spoiled_database(command: str, tmp_path: Path) -> None:
    path = Path(shutil.copy(bag(tmp_path)[1], tmp_path / "log.db3"))
    with sqlite3.connect(path) as database:
        database.execute(command)
    database.close()
    assert "log.db3" in refused(read, path)


def test_motion_of_digits(tmp_path: Path) -> None:
    path = tmp_path / "motion.json"
    point = {"positions": [0, 0, 0], "time_from_start": {"sec": 10**400, "nanosec": 0}}
    path.write_text(json.dumps({"joint_names": JOINTS, "points": [point, point]}), encoding="utf-8")
    assert "time_from_start" in refused(motion, path)


@pytest.mark.parametrize(
    ("header", "word"),
    [
        # Names come first, and are numbers here.
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }", "names as text"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (40,), }", "never opened"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': " + "(" * 500, "not a readable .npz"),
    ],
    ids=["huge", "pickle", "brackets"],
)
def test_motion_archives(header: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "motion.npz"
    head = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("t", "q", "joint_names"):
            archive.writestr(f"{name}.npy", head + b"\0" * 100)
    assert word in refused(motion, path)


def test_what_a_file_says_is_told_in_part(tmp_path: Path) -> None:
    path = tmp_path / "motion.yaml"
    path.write_text(f"joint_names: [a]\npoints: [{{positions: [1{'*a' * 40_000}]}}]\n")
    message = refused(motion, path)
    assert "motion.yaml" in message
    assert len(message) < 1000
