"""Measured data, motions and results made to read other files, to fill memory or to crash."""

import gzip
import io
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

from benchmarks.trust.data_files import JOINTS, BagFuzzer, recorded
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement import reader
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.motion_files import read_motion
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


def replaced(name: str, value: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]
        file[name] = value

    return change


def external(file: h5py.File) -> None:
    del file["q"]
    file.create_dataset("q", (120, 3), "f8", external=[("/etc/passwd", 0, 2880)])


def virtual(file: h5py.File) -> None:
    del file["q"]
    layout = h5py.VirtualLayout(shape=(120, 3), dtype="f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "q", shape=(120, 3))
    file.create_virtual_dataset("q", layout)


def huge(rows: int, filled: bool = False) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        for name, shape in (("t", (rows,)), ("q", (rows, 3)), ("tau", (rows, 3))):
            del file[name]
            if filled:
                file.create_dataset(name, data=np.zeros(shape), compression="gzip", chunks=True)
            else:
                file.create_dataset(name, shape=shape, dtype="f8", chunks=True)

    return change


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (replaced("q", h5py.ExternalLink("/etc/passwd", "/q")), "is a link"),
        (replaced("q", h5py.SoftLink("/q")), "is a link"),
        (external, "keeps its data in other files"),
        (virtual, "keeps its data in other files"),
        (huge(10**12), "numbers"),
        (huge(2**24), "claims to hold"),
        (replaced("q", np.zeros(120, [("a", "f8")])), "does not hold numbers"),
        (replaced("q", np.full((120, 3), b"text")), "does not hold numbers"),
        (replaced("q", np.zeros((120, 3), complex)), "does not hold numbers"),
    ],
    ids=[
        "external link",
        "link to itself",
        "external data",
        "virtual",
        "1e12 rows",
        "no storage",
        "compound",
        "text",
        "complex",
    ],
)
def test_hdf5(change: Callable[[h5py.File], None], word: str, tmp_path: Path) -> None:
    assert word in refused(read, measured(tmp_path / "log.h5", change))


def test_hdf5_of_packed_zeros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "ALWAYS", 2**20)
    path = measured(tmp_path / "log.h5", huge(100_000, filled=True))
    assert "claims to hold" in refused(read, path)


def test_hdf5_that_packs_well_is_read(tmp_path: Path) -> None:
    """The limit must not refuse recordings: packed, with constant channels beside them."""
    data = recorded(np.random.default_rng(0), 2000)
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        for name, array in {**data, "idle": np.zeros((2000, 60))}.items():
            file.create_dataset(name, data=array, compression="gzip")
        file.attrs["joint_names"] = list(JOINTS)
    assert len(read(path).runs[0].t) == 2000


def stored(path: Path, change: Callable[[h5py.File], None]) -> Path:
    """The beginning of a result file, with something in it."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"program": "excite", "schema": 1})
        change(file)
    return path


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
    assert word in refused(read_result, stored(tmp_path / "result.h5", change))


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (",".join(f"q_{k}" for k in range(100_000)) + "\n1", "no whole rows"),
        ("t," + "x" * 2_000_000, "a line of more than"),
        ("q_1," * 100_000 + "\n1", "is there twice"),
        (HEADER + "\n" + "1e400,0,0,0,0,0,0\n" * 30, "nothing is left"),
        (HEADER + "\n" + "\n".join(f"{k}e-300,0,0,0,0,0,0" for k in range(30)), "no clock"),
        (HEADER + "\n" + "\0" * 1000, "log.csv"),
    ],
    ids=["wide", "long line", "doubled", "infinite", "tiny steps", "NUL"],
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


def bag(folder: Path) -> Path:
    """A rosbag2 folder of sqlite."""
    BagFuzzer().prepare(folder)
    return folder / "sqlite"


def test_bag_whose_metadata_is_a_bomb(tmp_path: Path) -> None:
    path = bag(tmp_path)
    levels = "a: &a [x, x, x]\n" + "".join(
        f"{chr(98 + k)}: &{chr(98 + k)} [{', '.join([f'*{chr(97 + k)}'] * 9)}]\n" for k in range(9)
    )
    (path / "metadata.yaml").write_text(levels, encoding="utf-8")
    assert "aliases" in refused(read, path)


def test_bag_whose_metadata_is_deep(tmp_path: Path) -> None:
    path = bag(tmp_path)
    (path / "metadata.yaml").write_text("[" * 50_000, encoding="utf-8")
    assert "nested deeper" in refused(read, path)


def test_bag_that_names_a_file_elsewhere(tmp_path: Path) -> None:
    path = bag(tmp_path)
    text = (path / "metadata.yaml").read_text(encoding="utf-8")
    name = next(file.name for file in path.iterdir() if file.suffix == ".db3")
    (path / "metadata.yaml").write_text(text.replace(name, "/dev/zero"), encoding="utf-8")
    assert "damaged" in refused(read, path)


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
    file = next(each for each in bag(tmp_path).iterdir() if each.suffix == ".db3")
    path = Path(shutil.copy(file, tmp_path / "log.db3"))
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
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }", "claims"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (40,), }", "never opened"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': " + "(" * 500, "not a readable .npz"),
    ],
    ids=["huge", "pickle", "brackets"],
)
def test_motion_archives(header: str, word: str, tmp_path: Path) -> None:
    buffer = io.BytesIO()
    head = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in ("t", "q", "joint_names"):
            archive.writestr(f"{name}.npy", head + b"\0" * 100)
    path = tmp_path / "motion.npz"
    path.write_bytes(buffer.getvalue())
    if word == "claims":  # names come first, and are numbers here
        word = "not names as text"
    assert word in refused(motion, path)
