"""Arrays and tables at hand in Python: read as a CSV of the same columns, to the last digit."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import ConfigError, ExciteError, FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.quality import raise_for_errors
from tests.measurement.recordings import BOUNDS, JOINTS, named, recorded, write_table

RUN = recorded()
T = RUN.t
UNEVEN = T + 1e-3 * np.random.default_rng(3).uniform(-1, 1, len(T))
HOLES = np.where(np.arange(len(T)) % 97, 1.0, np.nan)[:, None]
BACK = np.concatenate([T[:800], T[:800]])


def columns_of(run: Run, **more: np.ndarray) -> dict[str, np.ndarray]:
    columns = {"t": run.t, **named("q", run.q), **named("tau", run.tau)}
    return columns | ({} if run.dq is None else named("dq", run.dq)) | more


def same(one: Dataset, two: Dataset) -> None:
    assert one.findings == two.findings
    assert len(one.runs) == len(two.runs) > 0
    for first, second in zip(one.runs, two.runs, strict=True):
        for each in fields(Run):
            if each.name != "origin":  # which only a file has
                a, b = getattr(first, each.name), getattr(second, each.name)
                np.testing.assert_equal(a, b, each.name)


@pytest.mark.parametrize(
    ("run", "declared"),
    [
        (RUN, {}),
        (replace(RUN, t=UNEVEN), {}),
        (replace(RUN, t=1e3 * T), {"time": "ms"}),
        (replace(RUN, t=1.7e9 + T), {}),
        (replace(RUN, t=BACK), {}),
        (replace(RUN, q=np.degrees(RUN.q)), {}),
        (replace(RUN, q=np.degrees(RUN.q), dq=None), {"angle": "deg"}),
        (replace(RUN, tau=RUN.tau * HOLES), {"sign": {"elbow": -1}}),
        (replace(RUN, q=RUN.q * HOLES), {}),
        (replace(RUN, dq=-np.asarray(RUN.dq)), {}),
        (replace(RUN, tau=RUN.tau * [1.0, 0.0, 1.0]), {"without_torque": ["wrist"]}),
        (replace(RUN, tau=np.clip(RUN.tau, -9.0, 9.0)), {}),
    ],
)
def test_they_are_what_a_csv_of_them_is(run: Run, declared: dict, tmp_path: Path) -> None:
    spec = MeasurementSpec(**declared)
    table = columns_of(run)
    of_file = read_dataset([write_table(tmp_path / "run.csv", table)], spec, JOINTS, BOUNDS)
    arrays = Dataset.from_arrays(JOINTS, run.t, run.q, run.tau, dq=run.dq)
    frames: list[Any] = [pd.DataFrame(table), table, pa.table(table)]
    for given in (arrays, *map(Dataset.from_frame, frames)):
        assert given.as_given
        same(of_file, read_dataset(given, spec, JOINTS, BOUNDS))


def test_further_columns_are_found_by_what_the_config_calls_them(tmp_path: Path) -> None:
    warm, current = 20 + T, RUN.tau / 7.0
    declared: dict[str, Any] = {
        "channels": {"tau": "current"},
        "covariates": ["oil"],
        "names": {"A2": "elbow"},
    }
    called = ("shoulder", "A2", "wrist")
    more = {**named("current", current, called), "oil": warm}
    table = {"t": T, **named("q", RUN.q, called), **named("tau", RUN.tau, called), **more}
    spec = MeasurementSpec.model_validate(declared)
    of_file = read_dataset([write_table(tmp_path / "run.csv", table)], spec, JOINTS)
    arrays = Dataset.from_arrays(
        called, T, RUN.q, RUN.tau, covariates={"oil": warm}, extra={"current": current}
    )
    without = Dataset.from_arrays(
        called, T, RUN.q, covariates={"oil": warm}, extra={"current": current}
    )
    same(of_file, read_dataset(arrays, spec, JOINTS))
    same(of_file, read_dataset(Dataset.from_frame(pd.DataFrame(table)), spec, JOINTS))
    np.testing.assert_array_equal(read_dataset(without, spec, JOINTS).runs[0].tau, current)


def test_units_and_dates_of_columns_are_understood(tmp_path: Path) -> None:
    table = columns_of(replace(RUN, dq=None))
    odd = {f"{key} [deg]" if key[0] == "q" else key: x for key, x in table.items()}
    of_file = read_dataset([write_table(tmp_path / "run.csv", odd)], MeasurementSpec(), JOINTS)
    same(of_file, read_dataset(Dataset.from_frame(odd), MeasurementSpec(), JOINTS))
    frame = pd.DataFrame(table)
    frame["t"] = pd.Timestamp("2024-05-01") + pd.to_timedelta(np.round(1e6 * T), unit="us")
    frame["who"] = "somebody"
    dated = read_dataset(Dataset.from_frame(frame), MeasurementSpec(), JOINTS)
    np.testing.assert_allclose(dated.runs[0].t, T, atol=1e-6)
    assert dated.runs[0].epoch == pd.Timestamp("2024-05-01").timestamp()
    assert [each.text for each in dated.findings] == ["columns of words are left out: who"]


def test_several_recordings_have_names(tmp_path: Path) -> None:
    runs = [recorded(name="a"), recorded(5.0, name="b", seed=4)]
    paths = [write_table(tmp_path / f"{each.name}.csv", columns_of(each)) for each in runs]
    of_files = read_dataset(paths, MeasurementSpec(), JOINTS)
    t, q, tau, dq = ([getattr(each, key) for each in runs] for key in ("t", "q", "tau", "dq"))
    arrays = Dataset.from_arrays(JOINTS, t, q, tau, dq=dq, names=["a", "b"])
    frames = Dataset.from_frame([pd.DataFrame(columns_of(r)) for r in runs], names=["a", "b"])
    for given in (arrays, frames):
        same(of_files, read_dataset(given, MeasurementSpec(), JOINTS))
    assert Dataset.from_arrays(JOINTS, t, q, tau).recordings == ("run_1", "run_2")
    part = replace(arrays, runs=arrays.runs[1:])
    assert read_dataset(part, MeasurementSpec(), JOINTS).recordings == ("b",)


Q, TAU = RUN.q, RUN.tau


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Dataset.from_arrays(JOINTS, T, Q.T, TAU), r"q has shape \(3, 1600\)"),
        (lambda: Dataset.from_arrays(JOINTS, T, Q, TAU[:9]), r"tau has shape \(9, 3\)"),
        (lambda: Dataset.from_arrays(JOINTS, Q, Q, TAU), r"t has shape \(1600, 3\)"),
        (lambda: Dataset.from_arrays(JOINTS, 3.0, Q, TAU), r"t has shape \(\)"),
        (lambda: Dataset.from_arrays(JOINTS[:2], T, Q, TAU), r"2 joints, a row per instant"),
        (lambda: Dataset.from_arrays("arm", T, Q, TAU), "joint_names is 'arm'"),
        (lambda: Dataset.from_arrays(["a", "a", "b"], T, Q, TAU), "list of different names"),
        (lambda: Dataset.from_arrays(JOINTS, T, Q, [["x"]]), "expected numbers"),
        (lambda: Dataset.from_arrays(JOINTS, [T, T], [Q], [TAU, TAU]), "q: give a list of 2 arr"),
        (lambda: Dataset.from_arrays(JOINTS, [T], [Q], [TAU], names=["a", "b"]), "each of 1 reco"),
        (lambda: Dataset.from_arrays(JOINTS, [T, T], [Q, Q], names=["a", "a"]), "one of its own"),
        (lambda: Dataset.from_arrays(JOINTS, T, Q, TAU, covariates={"w": Q}), r"w has shape"),
        (lambda: Dataset.from_arrays(JOINTS, T, Q, TAU, extra={"w": Q[:, :2]}), r"w has shape"),
        (lambda: Dataset.from_arrays(JOINTS, T[:1], Q[:1], TAU[:1]), r"t \(1,\)"),
        (lambda: Dataset.from_arrays(JOINTS, T[:0], Q[:0], TAU[:0]), r"t \(0,\)"),
        (lambda: Dataset.from_arrays(JOINTS, None, Q, TAU), r"t has shape \(\)"),  # type: ignore[arg-type]
        (lambda: Dataset.from_frame({"who": ["a", "b"]}), "no column holds numbers: who"),
        (lambda: Dataset.from_frame(3), "frame is int"),
        (lambda: Dataset.from_frame([]), "each of 0 recordings"),
        (lambda: Dataset.from_frame({"t": T, "q_a": T[:5]}), r"q_a \(5,\)\. Give a value"),
    ],
)  # fmt: skip
def test_what_they_cannot_be_is_said_at_once(make: Any, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        make()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (Dataset.from_arrays(["a", *JOINTS[1:]], T, Q, TAU), "no position of joint 'shoulder'"),
        (Dataset.from_arrays(JOINTS, T, Q), "so there are no torques"),
        (Dataset.from_arrays(JOINTS, T, Q * np.inf, TAU), "nothing is left"),
        (Dataset.from_arrays(JOINTS, T[:5], Q[:5], TAU[:5]), "has 5 samples"),
        (Dataset.from_arrays(JOINTS, 0 * T, Q, TAU), "time stands still"),
        (Dataset.from_frame({"x": T}), "no columns 'q_<joint>'"),
        (Dataset.from_frame({"t": T, "tau_wrist": T}), "so there are no positions"),
        (Dataset.from_frame(named("q", Q)), "no time stamps 't'"),
        (Dataset.from_arrays(JOINTS, T, Q, TAU, dq=-np.asarray(RUN.dq)), "opposite sign"),
    ],
)
def test_what_no_file_may_hold_they_may_not(given: Dataset, words: str) -> None:
    with pytest.raises(FileError, match=words) as caught:
        raise_for_errors(read_dataset(given, MeasurementSpec(), JOINTS))
    assert str(caught.value).startswith("data from Python")
    assert isinstance(caught.value, ExciteError)
