"""Parquet: tables named as in a CSV, and datasets of LeRobot as versions 2.1 and 3.0 lay them."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from excite_cli.errors import FileError, MissingExtraError
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.run_identity import Origin
from tests.measurement import recordings
from tests.measurement.recordings import refused
from tests.measurement.test_formats import JOINTS, PLAIN, TAU, Q, T, assert_same, read


def lists(values: Array) -> Any:
    """As LeRobot writes a feature of shape (n,): lists of n float32."""
    flat = pa.array(values.astype("f4").ravel())
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def write_dataset(
    folder: Path, features: dict[str, tuple[Any, Array]], episodes: int = 1, one_file: bool = True
) -> Path:
    """Features as name: (names of entries, values (T, n)), in every episode the same."""
    described = {
        name: {"dtype": "float32", "shape": [values.shape[1]], "names": names}
        for name, (names, values) in features.items()
    }
    (folder / "meta").mkdir(parents=True)
    info = {"codebase_version": "v3.0" if one_file else "v2.1", "features": described}
    (folder / "meta" / "info.json").write_text(json.dumps(info), encoding="utf-8")
    data = folder / "data" / "chunk-000"
    data.mkdir(parents=True)
    tables = []
    for episode in range(episodes):
        columns = {name: lists(values) for name, (_, values) in features.items()}
        numbers = np.arange(len(T))
        columns["observation.images.top"] = pa.array([{"bytes": b"x", "path": ""}] * len(T))
        columns |= {"timestamp": pa.array(T.astype("f4")), "frame_index": pa.array(numbers)}
        columns |= {"episode_index": pa.array(np.full(len(T), episode))}
        columns |= {"index": pa.array(numbers), "task_index": pa.array(0 * numbers)}
        tables.append(pa.table(columns))
    if one_file:
        parquet.write_table(pa.concat_tables(tables), data / "file-000.parquet")
        return data / "file-000.parquet"
    for episode, table in enumerate(tables):
        parquet.write_table(table, data / f"episode_{episode:06d}.parquet")
    return data / "episode_000000.parquet"


TURNED = list(JOINTS[::-1])
IN_STATE = [f"{j}.{word}" for j in TURNED for word in ("pos", "torque")]
STATE = np.column_stack([Q[:, 1], TAU[:, 1], Q[:, 0], TAU[:, 0]])
BESIDE = {"observation.effort": (None, TAU[:, ::-1]), "action": (TURNED, Q[:, ::-1])}
LAYOUTS: dict[str, dict[str, tuple[Any, Array]]] = {
    "torques in the state": {"observation.state": (IN_STATE, STATE)},
    "efforts beside it": {"observation.state": ({"motors": TURNED}, Q[:, ::-1]), **BESIDE},
    "names in a list": {"observation.state": ([TURNED], Q[:, ::-1]), **BESIDE},
    "names with numbers": {
        "observation.state": ({"elbow.pos": 0, "base.pos": 1}, Q[:, ::-1]),
        "observation.torque": (TURNED, TAU[:, ::-1]),
    },
    "no names": {"observation.state": (None, Q), "observation.effort": (None, TAU)},
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_lerobot(tmp_path: Path, layout: str) -> None:
    write_dataset(tmp_path / "set", LAYOUTS[layout])
    assert_same(read(tmp_path / "set/data/chunk-000/file-000.parquet", time="ms"))


def test_a_new_process_reads_within_the_limit_of_memory(tmp_path: Path) -> None:
    """In this one, the library has its memory from writing."""
    path = write_dataset(tmp_path / "set", LAYOUTS["torques in the state"])
    program = (
        "from pathlib import Path; from excite_cli.measurement.parquet_reader import read_parquet; "
        f"print(read_parquet(Path({str(path)!r})).columns['observation.state'].shape)"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert ended.stdout.strip() == f"({len(T)}, 4)", ended.stderr


@pytest.mark.parametrize("one_file", [True, False])
def test_every_episode_is_a_run(tmp_path: Path, one_file: bool) -> None:
    path = write_dataset(tmp_path / "set", LAYOUTS["torques in the state"], 3, one_file)
    data = recordings.read(tmp_path / "set", *JOINTS)
    assert [run.name for run in data.runs] == [f"episode_{k:06d}" for k in range(3)]
    for run in data.runs:
        assert_same(run)
    single = recordings.read(path, *JOINTS)
    assert len(single.runs) == (3 if one_file else 1)
    assert single.runs[0].origin == Origin(str(path), "episode_index 0")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "a.parquet"


def plain(*columns: Any, names: list[str] = PLAIN) -> pa.Table:
    return pa.table(dict(zip(names, columns, strict=True)))


def test_a_plain_table_is_named_as_a_csv(log: Path) -> None:
    stamps = pa.array((T * 1e6 + 1.75e15).astype("i8"), pa.timestamp("us"))
    names = ["t", "q_base [deg]", "q_elbow [deg]", *PLAIN[3:]]
    parquet.write_table(plain(stamps, *np.degrees(Q).T, *TAU.T, names=names), log)
    assert_same(read(log))
    arrays = {"t": T, "q": lists(Q), "tau": lists(TAU), "note": ["warm"] * len(T)}
    parquet.write_table(pa.table(arrays), log)
    assert_same(read(log))
    spoiled = pa.array(np.where(np.arange(len(T)) == 7, np.nan, Q[:, 0]), from_pandas=True)
    parquet.write_table(plain(T, spoiled, Q[:, 1], *TAU.T), log)
    run = read(log)
    assert len(run.q) == len(T)
    assert not run.usable()[7, 0]


def test_a_wrong_file_gets_one_sentence(log: Path) -> None:
    log.write_bytes(b"no such thing")
    refused(log, "a.parquet is not a readable parquet file")
    parquet.write_table(pa.table({"t": T, "pos": Q[:, 0]}), log)
    refused(log, "no columns 'q_<joint>'; its columns: t, pos")
    for useless in (["warm"], [[1.0], [1.0, 2.0]], pa.array([], pa.float64())):
        parquet.write_table(pa.table({"note": useless}), log)
        refused(log, "has no rows of numbers; its columns: note")
    zeros = pa.array(np.zeros(2**25, "i1"))  # they are not unpacked
    parquet.write_table(pa.table({"t": zeros}), log, compression="zstd")
    assert log.stat().st_size < 200_000
    refused(log, "made to fill the memory")


def test_what_lacks_in_lerobots_files_is_said(tmp_path: Path) -> None:
    """Most arms of LeRobot record no torques."""
    path = write_dataset(tmp_path / "set", {"observation.state": (TURNED, Q[:, ::-1])}, 2)
    refused(tmp_path / "set", "has no torques; it has: q_elbow, q_base, t.")
    (tmp_path / "set" / "meta" / "info.json").write_text("[" * 100_000)
    with pytest.raises(FileError, match=r"info\.json does not describe LeRobot's columns"):
        read(path)


def test_without_pyarrow_there_is_one_message(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parquet.write_table(pa.table({"t": T}), log)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[parquet\]'"):
        read(log)
