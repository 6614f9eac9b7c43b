"""CSV files: every way to write a table, and a message for every way to spoil one."""

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.text_table import read_table
from tests.measurement.recordings import (
    JOINTS,
    only,
    read,
    recorded,
    refused,
    without_speed,
    write_csv,
)

RUN = recorded()


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_csv(tmp_path / "log.csv", RUN)


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", "])
def test_round_trip(tmp_path: Path, separator: str) -> None:
    data = read(write_csv(tmp_path / "log.csv", RUN, separator=separator))
    assert data.findings == ()
    (back,) = data.runs
    assert back.name == "log"
    for name in ("t", "q", "dq", "tau"):
        np.testing.assert_array_equal(getattr(back, name), getattr(RUN, name))


def test_columns_are_matched_by_name(log: Path) -> None:
    back = read(log, "wrist", "shoulder", "elbow").runs[0]
    np.testing.assert_array_equal(back.tau, RUN.tau[:, [2, 0, 1]])
    np.testing.assert_array_equal(back.dq, RUN.dq[:, [2, 0, 1]])  # type: ignore[index]


def test_packed_with_byte_order_mark_or_with_a_header_behind_a_hash(log: Path) -> None:
    text = log.read_text()
    path = log.with_name("log.csv.gz")
    path.write_bytes(gzip.compress(("\ufeff" + text).encode()))
    assert len(read(path).runs[0].t) == 1600
    log.write_text("# " + text)  # as NumPy writes it
    np.testing.assert_array_equal(read(log).runs[0].q, RUN.q)


def test_decimal_comma(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", RUN, separator=";")
    path.write_text(path.read_text().replace(".", ","))
    data = read(path)
    only(data.findings, "decimal_comma")
    np.testing.assert_array_equal(data.runs[0].tau, RUN.tau)


def test_numbered_columns_say_their_order(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", RUN, ("1", "2", "3"))
    data = read(path)
    found = only(data.findings, "numbered")
    assert found.severity == "note"
    assert "1 is shoulder, 2 is elbow, 3 is wrist" in found.text
    np.testing.assert_array_equal(data.runs[0].q, RUN.q)
    with pytest.raises(FileError, match=r"moves 2 joints \(a, b\).*measurement.names"):
        read(path, "a", "b")


def test_names_lead_to_joints(log: Path, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "other.csv", RUN, ("A1", "A2", "A3"))
    names = {"A3": "shoulder", "A1": "elbow", "A2": "wrist"}
    np.testing.assert_array_equal(read(path, names=names).runs[0].q, RUN.q[:, [2, 0, 1]])
    refused(path, "no position of joint 'shoulder'", "measurement.names")
    for file, wrong, words in (
        (log, {"A4": "wrist"}, "no file has a joint 'A4'"),
        (path, {"A1": "elbo"}, r"does not move.*Did you mean 'elbow'"),
        (path, {"A1": "elbow", "A2": "elbow"}, "two columns to 'elbow'"),
    ):
        with pytest.raises(ConfigError, match=words):
            read(file, names=wrong)
    near = write_csv(tmp_path / "near.csv", RUN, ("shoulder", "elbow_joint", "wrist"))
    refused(near, "joint 'elbow'", "Did you mean 'elbow_joint'")


def test_other_joints_and_channels_are_kept(log: Path) -> None:
    data = read(log, "wrist", "shoulder")
    only(data.findings, "other_joints")
    np.testing.assert_array_equal(data.runs[0].extra["tau_elbow"], RUN.tau[:, 1])
    head, *rows = log.read_text().splitlines()
    rows = [f"{head},temperature,ref_elbow", *(f"{row},21.5,7" for row in rows)]
    log.write_text("\n".join(rows))
    extra = read(log).runs[0].extra
    assert (extra["temperature"] == 21.5).all()
    assert (extra["ref_elbow"] == 7).all()


def test_torque_from_another_channel_and_speeds_left_out(log: Path) -> None:
    back = read(log, channels={"dq": None}).runs[0]
    assert back.dq is None
    assert "dq_in_file" in back.extra
    log.write_text(log.read_text().replace("tau_", "current_"))
    scale: dict[str, Any] = {"torque": "current", "gear_ratio": 10.0, "torque_constant": 0.5}
    back = read(log, channels={"tau": "current"}, **scale).runs[0]
    np.testing.assert_allclose(back.tau, 5 * RUN.tau)
    with pytest.raises(FileError, match=r"no columns 'tau_<joint>'.*measurement.channels: \{tau"):
        read(log)


def test_no_time_stamps(log: Path) -> None:
    log.write_text("\n".join(line.split(",", 1)[1] for line in log.read_text().splitlines()))
    refused(log, "no time stamps 't'", "measurement.rate")
    np.testing.assert_allclose(read(log, rate=200.0, time="ms").runs[0].t, RUN.t)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ("is empty",)),
        ("t,q_1,tau_1\n", ("no rows",)),
        ("0,1,2\n1,2,3\n", ("has no header", "t, q_<joint>")),
        ("t,q_1,q_1\n0,1,2\n", ("'q_1' is there twice",)),
        ("t,,tau_1\n0,1,2\n", ("a column has no name",)),
        ("t,q_1,tau_1\n0,1,2\n1,2\n2,3,4\n", ("line 3", "2 fields", "3 columns")),
        ("t,q_1,tau_1\n0,1,2\n1,x7,3\n", ("line 3", "'x7' in column 'q_1'")),
        ("t,q_1,tau_1\n" + "1" * 2**21, ("a line of more than", "MiB")),
        ("Joint_1,Joint_2\n0.1,0.2\n0.1,0.3\n",
         ("its columns: Joint_1, Joint_2", "t, q_<joint>", "joined")),
        (b"\xff\xfe\x00t", ("a header and no rows",)),
    ],
)  # fmt: skip
def test_spoiled_tables(tmp_path: Path, text: str | bytes, parts: tuple[str, ...]) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    refused(path, *parts)


def test_damaged_gzip(log: Path) -> None:
    path = log.with_name("log.csv.gz")
    for content in (gzip.compress(log.read_bytes())[:2000], b"no gzip at all"):
        path.write_bytes(content)
        refused(path, "damaged or cut off .gz")


def test_empty_fields_words_and_a_cut_row(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "log.csv", without_speed(RUN))
    head, *rows = path.read_text().splitlines()
    rows = [f"{row},auto" for row in rows]
    fields = rows[99].split(",")
    rows[99] = ",".join([*fields[:4], "", *fields[5:]])
    path.write_text("\n".join([f"{head},mode", *rows]) + "\n7.9,0.1")
    data = read(path)
    assert [found.kind for found in data.findings] == ["truncated", "words", "nan_torque"]
    valid = data.runs[0].usable()
    assert valid.shape == (1600, len(JOINTS))
    assert np.argwhere(~valid).tolist() == [[99, 0]]


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture],
          deadline=None)  # fmt: skip
@given(
    table=arrays(float, st.tuples(st.integers(1, 8), st.just(3)),
                 elements=st.floats(allow_nan=True, allow_infinity=True)),
    separator=st.sampled_from([",", ";", "\t", " "]),
)  # fmt: skip
def test_any_numbers_survive(tmp_path: Path, table: np.ndarray, separator: str) -> None:
    path = tmp_path / "any.csv"
    rows = [["a", "b", "c"], *(map(repr, row) for row in table.tolist())]
    path.write_text("\n".join(map(separator.join, rows)))
    back = np.column_stack(list(read_table(path).columns.values()))
    np.testing.assert_array_equal(back, table)


@pytest.mark.parametrize(
    ("begins", "words"),
    [
        (b"\x89HDF\r\n\x1a\n", "it is an HDF5 file. Name it log.h5 (in a campaign: --log .h5)."),
        (b"PAR1\xff\x80", "it is a parquet file. Name it log.parquet"),
        (b"\xff\x80\x81", "codec can't decode"),
    ],
)
def test_a_file_of_another_kind_is_named(tmp_path: Path, begins: bytes, words: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(begins + b"\xff\n" * 100)
    with pytest.raises(FileError, match=r"is not a text table") as told:
        read_table(path)
    assert words in str(told.value)
