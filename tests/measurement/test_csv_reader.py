"""CSV files: every way to write a table, and a message for every way to spoil one."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.csv_table import read_table
from tests.measurement.recordings import JOINTS, only, read, recorded, without_speed, write_csv


def refused(path: Path, text: str, *parts: str, **declared: object) -> str:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileError) as caught:
        read(path, **declared)
    message = str(caught.value)
    assert str(path) in message
    for part in parts:
        assert part in message
    return message


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", "])
def test_round_trip(tmp_path: Path, separator: str) -> None:
    run = recorded()
    data = read(write_csv(tmp_path / "log.csv", run, separator=separator))
    assert data.findings == ()
    (back,) = data.runs
    assert back.name == "log"
    for name in ("t", "q", "dq", "tau"):
        np.testing.assert_array_equal(getattr(back, name), getattr(run, name))


def test_columns_are_matched_by_name(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", run)
    back = read(path, "wrist", "shoulder", "elbow").runs[0]
    np.testing.assert_array_equal(back.tau, run.tau[:, [2, 0, 1]])
    np.testing.assert_array_equal(back.dq, run.dq[:, [2, 0, 1]])  # type: ignore[index]


def test_packed_with_byte_order_mark(tmp_path: Path) -> None:
    text = write_csv(tmp_path / "log.csv", recorded()).read_text()
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(("\ufeff" + text).encode()))
    assert len(read(path).runs[0].t) == 1600


def test_header_behind_a_hash(tmp_path: Path) -> None:
    run = without_speed(recorded())
    header = ",".join(["t", *(f"q_{j}" for j in JOINTS), *(f"tau_{j}" for j in JOINTS)])
    path = tmp_path / "log.txt"
    np.savetxt(path, np.column_stack([run.t, run.q, run.tau]), delimiter=",", header=header)
    np.testing.assert_array_equal(read(path).runs[0].q, run.q)


def test_decimal_comma(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", run, separator=";")
    path.write_text(path.read_text().replace(".", ","))
    data = read(path)
    only(data.findings, "decimal_comma")
    np.testing.assert_array_equal(data.runs[0].tau, run.tau)


def test_numbered_columns_say_their_order(tmp_path: Path) -> None:
    run = recorded()
    data = read(write_csv(tmp_path / "log.csv", run, ("1", "2", "3")))
    found = only(data.findings, "numbered")
    assert found.severity == "note"
    assert "1 is shoulder, 2 is elbow, 3 is wrist" in found.text
    np.testing.assert_array_equal(data.runs[0].q, run.q)


def test_numbered_columns_that_do_not_fit(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", recorded(), ("1", "2", "3"))
    with pytest.raises(FileError, match=r"moves 2 joints \(a, b\).*measurement.names"):
        read(path, "a", "b")


def test_names_lead_to_joints(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", run, ("A1", "A2", "A3"))
    names = {"A3": "shoulder", "A1": "elbow", "A2": "wrist"}
    np.testing.assert_array_equal(read(path, names=names).runs[0].q, run.q[:, [2, 0, 1]])
    with pytest.raises(FileError, match=r"no position of joint 'shoulder'.*measurement\.names"):
        read(path)
    with pytest.raises(ConfigError, match="no file has a joint 'A4'"):
        read(write_csv(tmp_path / "b.csv", run), names={"A4": "wrist"})
    with pytest.raises(ConfigError, match=r"does not move.*Did you mean 'elbow'"):
        read(path, names={"A1": "elbo"})
    with pytest.raises(ConfigError, match="two columns to 'elbow'"):
        read(path, names={"A1": "elbow", "A2": "elbow"})


def test_missing_joint_names_the_nearest(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", recorded(), ("shoulder", "elbow_joint", "wrist"))
    with pytest.raises(FileError, match=r"joint 'elbow'.*Did you mean 'elbow_joint'"):
        read(path)


def test_other_joints_and_channels_are_kept(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", run)
    data = read(path, "wrist", "shoulder")
    only(data.findings, "other_joints")
    np.testing.assert_array_equal(data.runs[0].extra["tau_elbow"], run.tau[:, 1])
    lines = path.read_text().splitlines()
    lines = [lines[0] + ",temperature,ref_elbow"] + [line + ",21.5,7" for line in lines[1:]]
    path.write_text("\n".join(lines))
    extra = read(path).runs[0].extra
    assert (extra["temperature"] == 21.5).all()
    assert (extra["ref_elbow"] == 7).all()


def test_torque_from_another_channel(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", run)
    path.write_text(path.read_text().replace("tau_", "current_"))
    back = read(path, channels={"tau": "current"}, torque="current", gear_ratio=10.0,
                torque_constant=0.5).runs[0]  # fmt: skip
    np.testing.assert_allclose(back.tau, 5 * run.tau)
    with pytest.raises(FileError, match=r"no columns 'tau_<joint>'.*measurement.channels: \{tau"):
        read(path)


def test_speeds_left_out(tmp_path: Path) -> None:
    back = read(write_csv(tmp_path / "log.csv", recorded()), channels={"dq": None}).runs[0]
    assert back.dq is None
    assert "dq_in_file" in back.extra


def test_no_time_stamps(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", run)
    path.write_text("\n".join(line.split(",", 1)[1] for line in path.read_text().splitlines()))
    with pytest.raises(FileError, match=r"no time stamps 't'.*measurement\.rate"):
        read(path)
    np.testing.assert_allclose(read(path, rate=200.0, time="ms").runs[0].t, run.t)


def test_columns_of_nothing_known(tmp_path: Path) -> None:
    rows = "Joint_1,Joint_2\n0.1,0.2\n0.1,0.3\n"
    refused(tmp_path / "a.csv", rows, "its columns: Joint_1, Joint_2", "t, q_<joint>", "joined")


def test_spoiled_tables(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    refused(path, "", "is empty")
    refused(path, "t,q_1,tau_1\n", "no rows")
    refused(path, "0,1,2\n1,2,3\n", "has no header", "t, q_<joint>")
    refused(path, "t,q_1,q_1\n0,1,2\n", "'q_1' is there twice")
    refused(path, "t,,tau_1\n0,1,2\n", "a column has no name")
    refused(path, "t,q_1,tau_1\n0,1,2\n1,2\n2,3,4\n", "line 3", "2 fields", "3 columns")
    refused(path, "t,q_1,tau_1\n0,1,2\n1,x7,3\n", "line 3", "'x7' in column 'q_1'")
    path.write_bytes(b"\xff\xfe\x00t")
    with pytest.raises(FileError, match="a header and no rows"):
        read(path)


def test_damaged_gzip(tmp_path: Path) -> None:
    text = write_csv(tmp_path / "log.csv", recorded()).read_bytes()
    path = tmp_path / "log.csv.gz"
    for content in (gzip.compress(text)[:2000], b"no gzip at all"):
        path.write_bytes(content)
        with pytest.raises(FileError, match=r"damaged or cut off \.gz"):
            read(path)


def test_empty_fields_words_and_a_cut_row(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", without_speed(recorded()))
    lines = path.read_text().splitlines()
    lines = [lines[0] + ",mode"] + [line + ",auto" for line in lines[1:]]
    fields = lines[100].split(",")
    lines[100] = ",".join([*fields[:4], "", *fields[5:]])
    path.write_text("\n".join(lines) + "\n7.9,0.1")
    data = read(path)
    assert [found.kind for found in data.findings] == ["truncated", "words", "nan_torque"]
    assert len(data.runs[0].t) == 1600
    valid = data.runs[0].usable()
    assert not valid[99, 0]
    assert np.count_nonzero(~valid) == 1


def test_too_long_a_line(tmp_path: Path) -> None:
    refused(tmp_path / "a.csv", "t,q_1,tau_1\n" + "1" * 2**21, "MiB")


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture],
          deadline=None)  # fmt: skip
@given(
    table=arrays(float, st.tuples(st.integers(1, 8), st.just(3)),
                 elements=st.floats(allow_nan=True, allow_infinity=True)),
    separator=st.sampled_from([",", ";", "\t", " "]),
)  # fmt: skip
def test_any_numbers_survive(tmp_path: Path, table: np.ndarray, separator: str) -> None:
    path = tmp_path / "any.csv"
    rows = [separator.join(["a", "b", "c"])] + [
        separator.join(map(repr, r)) for r in table.tolist()
    ]
    path.write_text("\n".join(rows))
    back = np.column_stack(list(read_table(path).columns.values()))
    np.testing.assert_array_equal(back, table)
