"""Further columns that effects may follow: what they are called, and what becomes of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.covariates import with_declared
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.missing_values import rows_of
from tests.measurement.recordings import JOINTS, check, only, read, recorded, write_csv

WARM = "temp_elbow"


def csv_with(path: Path, **columns: list[str]) -> Path:
    """A clean run with further columns of the texts given, a row's after the other."""
    write_csv(path, recorded(2.0))
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    cells = zip(*columns.values(), strict=True)
    lines = [f"{row},{','.join(own)}" for row, own in zip(rows, cells, strict=True)]
    path.write_text("\n".join([f"{head},{','.join(columns)}", *lines]) + "\n", encoding="utf-8")
    return path


def test_a_slow_column_is_interpolated_and_held_at_the_end(tmp_path: Path) -> None:
    t = recorded(2.0).t
    once_a_second = [f"{20.0 + 5.0 * x:.6f}" if k % 200 == 0 else "" for k, x in enumerate(t)]
    path = csv_with(tmp_path / "log.csv", **{WARM: once_a_second})
    data = read(path, covariates=[WARM])
    assert only(data.findings, "interpolated").severity == "note"
    found = data.runs[0].covariates[WARM]
    assert found == pytest.approx(20.0 + 5.0 * np.minimum(t, 1.0), abs=1e-6)


def test_a_column_is_called_as_in_the_file_whatever_the_joints_are_called(tmp_path: Path) -> None:
    t = recorded(2.0).t
    columns = {"temp_1": [f"{x}" for x in t], "ambient": [f"{x + 20}" for x in t]}
    text = csv_with(tmp_path / "a.csv", **columns).read_text(encoding="utf-8")
    for number, joint in enumerate(JOINTS, 1):
        text = text.replace(f"_{joint}", f"_{number}")
    (tmp_path / "b.csv").write_text(text, encoding="utf-8")
    names = {str(number): joint for number, joint in enumerate(JOINTS, 1)}
    for called in ("temp_1", "temp_shoulder"):
        run = read(tmp_path / "b.csv", covariates=[called, "ambient"], names=names).runs[0]
        assert run.covariates[called] == pytest.approx(t)
        assert run.covariates["ambient"] == pytest.approx(t + 20.0)


def test_arrays_have_a_column_for_every_joint_or_number(tmp_path: Path) -> None:
    run = recorded(2.0)
    extra = {"temp": run.q, "supply": run.q[:, :2], "ambient": run.t}
    write_dataset(tmp_path / "a.h5", Dataset(JOINTS, (replace(run, extra=extra),)), {})
    names = [WARM, "supply_2", "ambient"]
    back = read(tmp_path / "a.h5", covariates=names)
    assert list(back.runs[0].covariates) == names
    np.testing.assert_array_equal(back.runs[0].covariates[WARM], run.q[:, 1])
    np.testing.assert_array_equal(back.runs[0].covariates["supply_2"], run.q[:, 1])
    write_dataset(tmp_path / "b.h5", back, {})
    again = read(tmp_path / "b.h5", covariates=names).runs[0]
    np.testing.assert_array_equal(again.covariates[WARM], run.q[:, 1])


def test_a_column_that_no_file_or_not_every_run_has_is_refused(tmp_path: Path) -> None:
    path = csv_with(tmp_path / "log.csv", **{WARM: ["1"] * 400})
    with pytest.raises(ConfigError, match=r"no file has a column 'temp_ebow'.*temp_elbow"):
        read(path, covariates=["temp_ebow"])
    first, second = recorded(2.0, name="a"), recorded(2.0, name="b", seed=1)
    runs = (replace(first, extra={"ambient": first.t}), second)
    write_dataset(tmp_path / "a.h5", Dataset(JOINTS, runs), {})
    with pytest.raises(FileError, match=r"run b: there is no column 'ambient'"):
        read(tmp_path / "a.h5", covariates=["ambient"])


def test_columns_that_nobody_declared_are_told_in_one_note(tmp_path: Path) -> None:
    rising = [f"{k}" for k in range(400)]
    path = csv_with(tmp_path / "log.csv", ambient=rising, mode=["3"] * 400, fan=rising)
    found = only(read(path).findings, "further_columns")
    assert found.severity == "note"
    assert "unused columns: ambient, fan." in found.text
    assert "measurement.covariates: [NAME]" in found.text
    assert "mode" not in found.text  # it never changes
    assert read(path, covariates=["fan"]).findings == ()


def test_long_times_without_a_value_are_told_and_none_at_all_is_an_error() -> None:
    run = recorded(30.0)
    column = 20.0 + run.t
    column[1000:5000] = np.nan
    (kept,), findings = check(replace(run, covariates={WARM: column}))
    assert only(findings, "interpolated").severity == "warning"
    assert "20 s" in findings[0].text
    assert kept.covariates[WARM] == pytest.approx(20.0 + run.t)
    _, findings = check(replace(run, covariates={WARM: np.full(len(run.t), np.nan)}))
    assert only(findings, "dead").severity == "error"


def test_columns_follow_the_run_through_gaps_jitter_and_lost_rows() -> None:
    run = recorded(8.0)
    t = run.t + np.random.default_rng(0).uniform(-2e-4, 2e-4, len(run.t))
    jittered = replace(run, t=t, dq=None, covariates={WARM: 20.0 + 3.0 * t}, q=run.q.copy())
    jittered.q[300, 1] = np.nan
    parts, _ = check(rows_of(jittered, (run.t < 3.5) | (run.t >= 4.5)))
    assert len(parts) == 2
    for part in (*parts, parts[0].cut(100, 200)):
        assert part.covariates[WARM] == pytest.approx(20.0 + 3.0 * part.t, abs=1e-9)


def test_data_at_hand_give_their_channels_for_columns() -> None:
    run = recorded(2.0)
    data = Dataset(JOINTS, (replace(run, extra={"ambient": run.t, "q_ref": run.q}),))
    assert list(with_declared(data, ["ambient"]).runs[0].covariates) == ["ambient"]
    assert with_declared(data, []).runs[0].covariates == {}
    with pytest.raises(ConfigError, match=r"no channel 'ambent'.*ambient"):
        with_declared(data, ["ambent"])
    broken = replace(run, extra={"ambient": np.full(len(run.t), np.nan)})
    with pytest.raises(FileError, match="NaN"):
        with_declared(Dataset(JOINTS, (broken,)), ["ambient"])
