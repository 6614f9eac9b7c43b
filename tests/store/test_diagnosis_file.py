"""Diagnoses go to a file and come back whole; other files are refused with one message."""

import json
from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Approximation, Diagnosis, JointAlias
from excite_cli.errors import FileError
from excite_cli.store.diagnosis_file import is_diagnosis, read_diagnosis, write_diagnosis
from excite_cli.store.result_file import is_result, read_result
from tests.diagnosis.synthetic_diagnosis import make_diagnosis, make_traces
from tests.store.conftest import Stored


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    return make_diagnosis()


@pytest.fixture
def path(diagnosis: Diagnosis, tmp_path: Path) -> Path:
    write_diagnosis(tmp_path / "diagnosis.h5", diagnosis)
    return tmp_path / "diagnosis.h5"


def same(first: object, second: object) -> bool:
    """Equal to the last bit, arrays and NaN included."""
    if isinstance(first, np.ndarray):
        return np.array_equal(first, np.asarray(second))
    if hasattr(first, "__dataclass_fields__"):
        return type(first) is type(second) and all(
            same(getattr(first, f.name), getattr(second, f.name)) for f in fields(first)
        )
    if isinstance(first, dict):
        assert isinstance(second, dict)
        return first.keys() == second.keys() and all(same(first[k], second[k]) for k in first)
    if isinstance(first, tuple):
        assert isinstance(second, tuple)
        return len(first) == len(second) and all(
            same(a, b) for a, b in zip(first, second, strict=True)
        )
    return first == second or (first != first and second != second)


def test_everything_comes_back(diagnosis: Diagnosis, path: Path) -> None:
    found = read_diagnosis(path)
    for field in fields(Diagnosis):
        assert same(getattr(diagnosis, field.name), getattr(found, field.name)), field.name


APPROXIMATIONS = [
    (
        Approximation((Covariate("speed", "elbow"), Covariate("time"))),
        {"covariates": ["v[elbow]", "time"], "kind": ""},
    ),
    (Approximation(kind="armature"), {"covariates": [], "kind": "armature"}),
]


@pytest.mark.parametrize(("found", "record"), APPROXIMATIONS)
def test_approximations_are_records(
    diagnosis: Diagnosis, tmp_path: Path, found: Approximation, record: dict
) -> None:
    doubted = replace(diagnosis.effects[0], approximates=found)
    path = tmp_path / "doubted.h5"
    write_diagnosis(path, replace(diagnosis, effects=(doubted,)))
    with h5py.File(path, "a") as file:
        (effect,) = json.loads(file["records/effects"][()])
        assert effect["approximates"] == record
        (left,) = json.loads(file["records/excess_residuals"][()])
        assert left["depends_on"] == ["q[elbow]", "load[elbow]"]
    assert read_diagnosis(path).effects[0].approximates == found


def test_a_dependence_on_nothing_known_is_damage(diagnosis: Diagnosis, path: Path) -> None:
    with h5py.File(path, "a") as file:
        text = file["records/excess_residuals"][()].decode().replace("load[", "mood of load[")
        del file["records/excess_residuals"]
        file["records/excess_residuals"] = text
    with pytest.raises(FileError, match="damaged"):
        read_diagnosis(path)


def test_what_may_be_missing_comes_back(diagnosis: Diagnosis, path: Path) -> None:
    floor = dict.fromkeys(diagnosis.joint_names, 0.25)
    one = diagnosis.effects[0].effect
    other = replace(one, kind="spring")
    pairs = (JointAlias((one,), (other, replace(other, runs=("a",)))),)
    write_diagnosis(path, replace(diagnosis, joint_aliases=pairs, noise_floor=floor))
    found = read_diagnosis(path)
    assert (found.joint_aliases, found.noise_floor) == (pairs, floor)
    with h5py.File(path, "a") as file:
        del file["records/joint_aliases"], file["records/noise_floor"]
    assert (read_diagnosis(path).joint_aliases, read_diagnosis(path).noise_floor) == ((), None)


@pytest.mark.parametrize("record", ["effects", "untouched", "after"])
def test_verdicts_and_errors_of_joints_that_are_not_its_own_are_damage(
    diagnosis: Diagnosis, tmp_path: Path, record: str
) -> None:
    path = tmp_path / "diagnosis.h5"
    after = replace(diagnosis.after, samples=dict.fromkeys(diagnosis.joint_names, 9))
    write_diagnosis(path, replace(diagnosis, untouched=diagnosis.after, after=after))
    read_diagnosis(path)
    with h5py.File(path, "a") as file:
        text = file[f"records/{record}"][()].decode()
        part = {"effects": '"removes": ', "untouched": '"rms": ', "after": '"samples": '}[record]
        ahead, rest = text.split(part)
        del file[f"records/{record}"]
        file[f"records/{record}"] = ahead + part + rest.replace('"elbow"', '"knee"', 1)
    with pytest.raises(FileError, match="damaged"):
        read_diagnosis(path)


def test_traces_come_back_and_older_files_have_none(diagnosis: Diagnosis, tmp_path: Path) -> None:
    traces, held_out = make_traces(diagnosis.joint_names)
    long = tmp_path / "traces.h5"
    write_diagnosis(long, replace(diagnosis, traces=traces, held_out_traces=held_out))
    found = read_diagnosis(long)
    assert found.traces is not None
    again = found.traces.runs + found.held_out_traces
    assert all(
        np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True)
        for a, b in zip(traces.runs + held_out, again, strict=True)
        for name in ("t", "q", "v", "a", "load", "measured", "counted", "predicted", "before")
    )
    assert [(t.run, t.held_out) for t in found.traces.runs] == [("run_1", False), ("run_2", False)]
    assert [(t.run, t.held_out) for t in found.held_out_traces] == [("run_3", True)]
    for name in ("part", "t", "x", "own", "partial"):
        expected, read = getattr(traces.effects[0], name), getattr(found.traces.effects[0], name)
        assert np.array_equal(expected, read, equal_nan=True), name
    for name in ("kind", "joints", "runs", "rows", "quantity", "unit", "period"):
        assert getattr(traces.effects[0], name) == getattr(found.traces.effects[0], name), name
    assert same(traces.dependence, found.traces.dependence)
    assert traces.torque_units == found.traces.torque_units
    with h5py.File(long, "a") as file:
        del file["traces"], file["held_out_traces"]
    assert (read_diagnosis(long).traces, read_diagnosis(long).held_out_traces) == (None, ())


@pytest.mark.parametrize(
    "name", ["traces/runs/0/q", "traces/effects/0/partial", "traces/dependence/shares"]
)
def test_damaged_traces(diagnosis: Diagnosis, tmp_path: Path, name: str) -> None:
    traces, held_out = make_traces(diagnosis.joint_names)
    path = tmp_path / "traces.h5"
    write_diagnosis(path, replace(diagnosis, traces=traces, held_out_traces=held_out))
    with h5py.File(path, "a") as file:
        cut = file[name][:-1]
        del file[name]
        file[name] = cut
    with pytest.raises(FileError, match="damaged"):
        read_diagnosis(path)


def test_files_are_told_apart(stored: Stored, path: Path, tmp_path: Path) -> None:
    text = tmp_path / "data.csv"
    text.write_text("t,q_1,tau_1\n", encoding="utf-8")
    assert (is_diagnosis(path), is_result(path)) == (True, False)
    assert (is_diagnosis(stored.path), is_result(stored.path)) == (False, True)
    assert not is_diagnosis(text)
    assert not is_result(text)
    with pytest.raises(FileError, match="not a diagnosis of this program"):
        read_diagnosis(stored.path)
    with pytest.raises(FileError, match=r"holds a diagnosis, not motions"):
        read_result(path)


def test_cut_files(path: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.h5"
    cut.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(FileError, match="not a readable HDF5 file"):
        read_diagnosis(cut)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("records/effects", '[{"effect": {"kind": 3}}]', "damaged"),
        ("records/before", "{", "damaged"),
        ("records/declared", '"none"', "damaged"),
    ],
)
def test_damaged_records(path: Path, name: str, text: str, words: str) -> None:
    with h5py.File(path, "a") as file:
        del file[name]
        file[name] = text
    with pytest.raises(FileError, match=words):
        read_diagnosis(path)


def test_missing_and_infinite_numbers(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file["information/factor"][0, 0] = np.nan
    with pytest.raises(FileError, match="not finite"):
        read_diagnosis(path)
    with h5py.File(path, "a") as file:
        del file["phi"]
    with pytest.raises(FileError, match="damaged"):
        read_diagnosis(path)


def test_newer_schema(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file.attrs["schema"] = 99
    with pytest.raises(FileError, match="schema 99"):
        read_diagnosis(path)
