"""HDF5: what is written comes back; foreign and hostile files get a message."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.foreign_hdf5 import attribute
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.reader import MAX_VALUES
from excite_cli.store.fit_file import is_fit, read_fit
from tests.measurement.recordings import JOINTS, only, read, recorded, refused, without_speed


def flat(path: Path, names: Any = JOINTS) -> Path:
    run = recorded()
    with h5py.File(path, "w") as file:
        for name in ("t", "q", "tau"):
            file[name] = getattr(run, name)
        if names is not None:
            file.attrs["joint_names"] = list(names)
    return path


def test_written_data_come_back(tmp_path: Path) -> None:
    first = recorded(name="a")
    valid = np.ones(first.q.shape, bool)
    valid[40:60, 1] = False
    first = replace(first, valid=valid, extra={"temperature": first.t + 20, "q_ref": first.q})
    second = without_speed(recorded(name="b/1", seed=1))
    path = tmp_path / "new" / "data.h5"
    write_dataset(path, Dataset(JOINTS, (first, second)), {"seed": 3, "effects": ["spring"]})
    data = read(path)
    assert "unused columns: temperature." in only(data.findings, "further_columns").text
    assert [run.name for run in data.runs] == ["a", "b/1"]
    for run, back in zip((first, second), data.runs, strict=True):
        for name in ("t", "q", "tau"):
            np.testing.assert_array_equal(getattr(back, name), getattr(run, name))
    np.testing.assert_array_equal(data.runs[0].dq, first.dq)
    assert data.runs[1].dq is None
    np.testing.assert_array_equal(data.runs[0].valid, valid)
    np.testing.assert_array_equal(data.runs[0].extra["q_ref"], first.q)
    with h5py.File(path) as file:
        assert file.attrs["seed"] == 3
    assert [file.name for file in path.parent.iterdir()] == ["data.h5"]


def test_names_decide_not_positions(tmp_path: Path) -> None:
    path = flat(tmp_path / "log.h5", [b"wrist", b"shoulder", b"elbow"])
    back = read(path).runs[0]
    assert back.name == "log"
    np.testing.assert_array_equal(back.q, recorded().q[:, [1, 2, 0]])
    refused(flat(tmp_path / "a.h5", None), "joint_names", "never by position alone", ".attrs[")
    refused(flat(tmp_path / "a.h5", ["x", "x", "y"]), "different names")
    refused(flat(tmp_path / "a.h5", [1.0, 2.0, 3.0]), "as text")
    refused(flat(tmp_path / "a.h5", ["a", "b"]), "(1600, 3)", "expected (samples, joints)")


def _replace(path: Path, name: str, value: Any) -> None:
    with h5py.File(path, "a") as file:
        del file[name]
        if value is not None:
            file[name] = value


def test_wrong_contents(tmp_path: Path) -> None:
    for name, value, parts in (
        ("tau", None, ("no dataset 'tau'", "measurement.channels: {tau")),
        ("q", None, ("no dataset 'q'",)),
        ("q", recorded().q.T, ("(3, 1600)",)),
        ("tau", recorded().tau.T, ("(3, 1600)", "transposed")),
        ("q", "words", ("does not hold numbers",)),
        ("q", np.zeros(1600, [("a", "f8")]), ("does not hold numbers",)),
        ("q", np.full((1600, 3), b"text"), ("does not hold numbers",)),
        ("q", np.zeros((1600, 3), complex), ("does not hold numbers",)),
        ("q", np.zeros((1600, 3, 2)), ("(1600, 3, 2)",)),
        ("t", None, ("no time stamps 't'", "measurement.rate")),
    ):
        path = flat(tmp_path / "a.h5")
        _replace(path, name, value)
        refused(path, *parts)
    np.testing.assert_allclose(read(path, rate=200.0).runs[0].t, recorded().t)


def test_torques_are_not_missed_where_only_the_base_has_rows(tmp_path: Path) -> None:
    path = flat(tmp_path / "a.h5")
    _replace(path, "tau", None)
    (run,) = read_dataset([path], MeasurementSpec(), JOINTS, rows=("base",)).runs
    np.testing.assert_array_equal(run.q, recorded().q)
    assert not run.usable().any()


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("external", "is a link"),
        ("soft", "is a link"),
        ("external file", "keeps its data in other files"),
        ("virtual", "keeps its data in other files"),
        ("runs", "is a link"),
    ],
)
def test_links_and_foreign_storage_are_refused(tmp_path: Path, kind: str, words: str) -> None:
    other = flat(tmp_path / "other.h5")
    path = flat(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        del file["tau"]
        if kind == "external":
            file["tau"] = h5py.ExternalLink(str(other), "/tau")
        elif kind == "soft":
            file["tau"] = h5py.SoftLink("/q")
        elif kind == "external file":
            file.create_dataset("tau", (1600, 3), float, external=[("/etc/passwd", 0, 38400)])
        elif kind == "virtual":
            layout = h5py.VirtualLayout((1600, 3), float)
            layout[:] = h5py.VirtualSource(str(other), "tau", (1600, 3))
            file.create_virtual_dataset("tau", layout)
        else:
            file["runs"] = h5py.ExternalLink(str(other), "/")
    refused(path, words, "only data in the file itself")


def test_giant_shapes_are_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("q", (MAX_VALUES, 6), float, chunks=(1024, 6), compression="gzip")
    assert path.stat().st_size < 100_000
    refused(path, f"{MAX_VALUES:,}")


def test_not_hdf5_and_not_measured(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(b"text")
    refused(path, "not a readable HDF5 file")
    content = flat(path).read_bytes()
    path.write_bytes(content[: len(content) // 2])
    refused(path, "not a readable HDF5 file")
    with h5py.File(path, "w") as file:
        file.create_group("motions/1")
    refused(path, "planned motions", "excite simulate")
    with h5py.File(path, "w") as file:
        file.create_group("runs")
    refused(path, "/runs has no group")


def test_what_is_no_channel_is_said(tmp_path: Path) -> None:
    path = flat(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        file["comment"] = "warm robot"
        file["alias"] = h5py.SoftLink("/nowhere")
    (found,) = read(path).findings
    assert found.kind == "left_out"
    assert "alias, comment" in found.text


def with_lists(path: Path, name: str) -> Path:
    """A file with an attribute of lists, which end the process where they are damaged."""
    lists = np.empty(2, dtype=object)
    lists[:] = [np.arange(3), np.arange(2)]
    with h5py.File(path, "a") as file:
        file.attrs.pop(name, None)
        file.attrs.create(name, lists, dtype=h5py.vlen_dtype(np.dtype("i4")))
    return path


def test_attributes_that_are_neither_numbers_nor_texts_are_not_read(tmp_path: Path) -> None:
    kept = {"names": ["a", "b"], "fixed": np.array([b"a", b"b"]), "count": 3, "good": True}
    with h5py.File(with_lists(tmp_path / "a.h5", "lists"), "a") as file:
        file.attrs.update(kept)
        for name, value in kept.items():
            assert np.array_equal(attribute(file, name), value)
        assert attribute(file, "none", "here") == "here"
        with pytest.raises(ValueError, match="'lists' holds neither numbers nor texts"):
            attribute(file, "lists")
    refused(with_lists(flat(tmp_path / "log.h5"), "joint_names"), "neither numbers nor texts")
    fit = with_lists(tmp_path / "fit.h5", "content")
    assert not is_fit(fit)
    with pytest.raises(FileError, match="neither numbers nor texts"):
        read_fit(fit)
