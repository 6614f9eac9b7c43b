"""Inputs that were measured or planned: CSV and motion files.

Valid ones are made first; inputs are copies, changed in samples, structure, texts or bytes.
"""

import gzip
import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trust.mutations import (
    Rng,
    chance,
    odd_samples,
    odd_text,
    one_of,
    pick,
    spoiled_bytes,
    spoiled_text,
    spoiled_tree,
)
from benchmarks.trust.trial import Fuzzer
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Array, Dataset
from excite_cli.measurement.quality import raise_for_errors
from excite_cli.motion_formats.catalogue import motion_format_of, read_motion

JOINTS = ("shoulder", "elbow", "wrist")
_BOUNDS = (np.full(3, -3.0), np.full(3, 3.0), np.full(3, 4.0), np.full(3, 50.0))
_TURNING = np.array([1.0, 1.0, 0.0])
# What a config may declare of the files.
_SPECS = (
    MeasurementSpec(),
    MeasurementSpec(rate=100.0, time="ms", angle="deg"),
    MeasurementSpec(channels={"tau": "current", "dq": None}, torque="current"),
    MeasurementSpec(names={"1": "shoulder", "2": "elbow", "3": "wrist"}),
)


def recorded(rng: Rng, samples: int = 120, rate: float = 100.0) -> dict[str, Array]:
    """t (T,), q, dq, tau (T, 3) of a smooth motion with noise."""
    t = np.arange(samples) / rate
    speed, phase = np.array([2.0, 2.9, 3.7]), np.array([0.0, 0.7, 1.9])
    angle = np.outer(t, speed) + phase
    q, dq = np.sin(angle), speed * np.cos(angle)
    tau = 12 * np.cos(q) + 0.4 * dq + rng.normal(0, 0.1, q.shape)
    return {"t": t, "q": q, "dq": dq, "tau": tau}


def enter_data(path: Path) -> Dataset:
    """As `diagnose` and `identify`: read, convert, check."""
    kind = path.stat().st_size % 8 if path.is_file() else 0
    spec = _SPECS[kind] if kind < len(_SPECS) else _SPECS[0]
    data = read_dataset([path], spec, JOINTS, _BOUNDS, _TURNING)
    raise_for_errors(data)
    for run in data.runs:
        whole = [np.isfinite(x).all() for x in (run.t, run.q, run.tau)]
        if not all(whole) or not (np.diff(run.t) > 0).all():
            raise AssertionError(f"a run with {whole} passed all checks")
    return data


def enter_motion(path: Path) -> bool:
    """As `check` and `view`: a motion, if the file is one."""
    if motion_format_of(path) is None:
        return False
    read_motion(path, JOINTS)
    return True


class OfRecording(Fuzzer):
    """Files of one recording; they are entered as measured data if not as a motion."""

    def open(self, bases: Path) -> None:
        """One recording, for all."""
        self._data = recorded(np.random.default_rng(0))

    def enter(self, path: Path) -> None:
        """As measured data if it has torques, else as a motion."""
        if not enter_motion(path):
            enter_data(path)


_CELLS = (
    *(b"\t", b" ", b"\r", b"\r\n", b"\x0b", b"\x1c", b"\x85", b"\n", b"0,0,0\n", b"1,2\n", b'"",'),
    *b", ; \" nan inf -inf 1e999 0x1p3 1_0 # % 1,5 none ,,,, ' ,q_1 ,c 1 \0".split(),
)
_HEADS = ["q_", "q[0]", "tau999999999999999999999", "q_q_q", "tau_tau_1", "dq_", "t_1"]


class CsvFuzzer(OfRecording):
    """CSV: spoiled samples, headers, separators, lines, cells and bytes, packed too."""

    name = "csv"

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled table."""
        path = folder / pick(rng, ("log.csv",) * 6 + ("log.tsv", "log.txt", "log.csv.gz"))
        made, data = one_of(rng, {
            "samples": (7, lambda: _table(rng, odd_samples(rng, self._data))),
            "header": (2, lambda: _table(rng, self._data, odd_header=True)),
            "text": (7, lambda: spoiled_text(rng, _table(rng, self._data), _CELLS)),
            "bytes": (3, lambda: spoiled_bytes(rng, _table(rng, self._data))),
            "binary": (1, lambda: rng.bytes(int(10 ** rng.uniform(0, 5)))),
        })  # fmt: skip
        if path.suffix == ".gz":
            data = gzip.compress(data, 1)
            if chance(rng, 0.4):
                data = spoiled_bytes(rng, data)
        path.write_bytes(data)
        return path, made


def _table(rng: Rng, data: dict[str, Array], odd_header: bool = False) -> bytes:
    separator = pick(rng, (",", ",", ",", ";", "\t", " "))
    names = list(JOINTS) if chance(rng, 0.7) else ["1", "2", "3"]
    channels = [c for c in ("q", "dq", "tau") if c != "dq" or chance(rng, 0.7)]
    if chance(rng, 0.15):
        channels, data = ["q", "dq", "ddq"], {**data, "ddq": data["tau"]}
    header = ["t"] + [f"{channel}_{name}" for channel in channels for name in names]
    columns = [data["t"], *(column for channel in channels for column in data[channel].T)]
    for _ in range(int(rng.integers(1, 4)) if odd_header else 0):
        new = pick(rng, (odd_text(rng), pick(rng, header), *_HEADS))
        header[int(rng.integers(len(header)))] = new
    rows = [separator.join(header)] if chance(rng, 0.97) else []
    form = pick(rng, ("%r", "%.6g", "%.3f"))
    rows += [separator.join(form % float(x) for x in row) for row in np.column_stack(columns)]
    if chance(rng, 0.1):
        rows = [row.replace(".", ",") for row in rows]
    code = pick(rng, ("utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1"))
    text: str = pick(rng, ("\n", "\n", "\r\n", "\r")).join(rows)
    return text.encode(code, "replace")


_WORDS = """
joint_names points positions velocities accelerations time_from_start sec nanosec secs nsecs
joint_trajectory effort
"""
_PIECES = (b"[", b'{"a":', b"{},", b'"a",', b"9", b" ", b"&a ", b"*a", b"- ")
_SHAPE_WORDS = b"1000000000000, 'O' '|V0' '<U999999999' ( (-1,) __import__('os') True".split()
_NPZ_VALUES = (
    *(np.zeros((40, 3), kind) for kind in ("c16", "M8[s]")),
    *(np.zeros(shape) for shape in ((0,), (), (3, 40), (40, 3, 1))),
    *(np.array(["a"] * 40), np.array([{}] * 40, dtype=object), np.zeros(40, "V8")),
)


class MotionFuzzer(Fuzzer):
    """Motions as controllers' files: JSON of MoveIt, YAML of ROS 2, NumPy archives."""

    name = "motions"

    def open(self, bases: Path) -> None:
        """One motion, for all."""
        data = self._data = recorded(np.random.default_rng(0), 40)
        points = [
            {
                "positions": data["q"][k].tolist(),
                "velocities": data["dq"][k].tolist(),
                "time_from_start": {"sec": 0, "nanosec": round(data["t"][k] * 1e9)},
            }
            for k in range(12)
        ]
        self._tree = {"joint_names": list(JOINTS), "points": points}

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled motion."""
        kind = pick(rng, ("json", "yaml", "npz"))
        tree = self._tree if kind == "yaml" else {"joint_trajectory": self._tree}

        def text(tree: Any) -> bytes:
            text = json.dumps(tree)  # which is YAML, too
            if kind == "yaml":
                text = text.replace("Infinity", ".inf").replace("NaN", ".nan")
            return text.encode("utf-8", "replace")

        ways: dict[str, tuple[float, Callable[[], bytes]]] = {
            "tree": (5, lambda: text(spoiled_tree(rng, tree, _WORDS.split()))),
            "text": (3, lambda: spoiled_text(rng, text(tree), _PIECES)),
            "bytes": (2, lambda: spoiled_bytes(rng, text(tree))),
        }
        made, data = one_of(rng, _archives(rng, self._data) if kind == "npz" else ways)
        path = folder / f"motion.{kind}"
        path.write_bytes(data)
        return path, f"{made} {kind}"

    def enter(self, path: Path) -> None:
        """As `check` and `view` read it."""
        if not enter_motion(path):
            raise FileError(f"{path} is no motion")


def _archives(rng: Rng, data: dict[str, Any]) -> dict[str, tuple[float, Callable[[], bytes]]]:
    """NumPy archives with odd samples, odd arrays, spoiled bytes and headers."""
    arrays = {"t": data["t"], "q": data["q"], "v": data["dq"], "joint_names": np.array(JOINTS)}

    def packed(**changed: Any) -> bytes:
        buffer = io.BytesIO()
        pick(rng, (np.savez, np.savez_compressed))(buffer, **(arrays | changed))
        return buffer.getvalue()

    def samples() -> bytes:
        odd = odd_samples(rng, data)
        return packed(t=odd["t"], q=odd["q"], v=odd["dq"])

    def headers() -> bytes:
        """Members that claim other shapes and types than there are, with the right checksums."""
        buffer = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(packed())) as old, zipfile.ZipFile(buffer, "w") as new:
            for name in old.namelist():
                head, rest = old.read(name)[:128], old.read(name)[128:]
                new.writestr(name, spoiled_text(rng, head, _SHAPE_WORDS) + rest)
        return buffer.getvalue()

    rows = int(pick(rng, (10**4, 10**6, 5 * 10**6)))
    return {
        "samples": (2, samples),
        "array": (1, lambda: packed(**{pick(rng, list(arrays)): pick(rng, _NPZ_VALUES)})),
        "bytes": (1, lambda: spoiled_bytes(rng, packed())),
        "headers": (1, headers),
        # A thousand times as large in memory as on disk.
        "zeros": (1, lambda: packed(t=np.arange(40.0), q=np.zeros((rows, 3)))),
    }
