"""Inputs that were measured, planned or stored: CSV, HDF5, own results, ROS bags, motion files.

Valid ones are made first; inputs are copies, changed in samples, structure, records or bytes.
Structured HDF5 is made with h5py; shapes without storage claim what no machine holds.
"""

import contextlib
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

from benchmarks.trust.mutations import (
    Rng,
    chance,
    large,
    odd_number,
    odd_samples,
    odd_text,
    odd_value,
    one_of,
    pick,
    spoiled_bytes,
    spoiled_text,
    spoiled_tree,
)
from benchmarks.trust.trial import Fuzzer
from excite_cli import (
    diagnose,
    identify,
    load_problem,
    motions_of,
    plan,
    save_fit,
    simulate,
)
from excite_cli.api.report_figures import read_files
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.excitation.result import Result
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Array, Dataset
from excite_cli.measurement.quality import raise_for_errors
from excite_cli.motion_formats.catalogue import motion_format_of, read_motion
from excite_cli.store.result_file import read_samples, write_result

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


def _enter_data(path: Path) -> Dataset:
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


def _enter_motion(path: Path) -> bool:
    """As `check` and `view`: a motion, if the file is one."""
    if motion_format_of(path) is None:
        return False
    read_motion(path, JOINTS)
    return True


class _OfRecording(Fuzzer):
    """Files of one recording; they are entered as measured data if not as a motion."""

    def open(self, bases: Path) -> None:
        """One recording, for all."""
        self._data = recorded(np.random.default_rng(0))

    def enter(self, path: Path) -> None:
        """As measured data if it has torques, else as a motion."""
        if not _enter_motion(path):
            _enter_data(path)


_CELLS = (
    *(b"\t", b" ", b"\r", b"\r\n", b"\x0b", b"\x1c", b"\x85"),
    *b", ; \" nan inf -inf 1e999 0x1p3 1_0 # % 1,5 none ,,,, '".split(),
)
_HEADS = ["q_", "q[0]", "tau999999999999999999999", "q_q_q", "tau_tau_1", "dq_", "t_1"]


class CsvFuzzer(_OfRecording):
    """CSV: spoiled samples, headers, separators, lines and bytes; bombs in `.gz`."""

    name = "csv"

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled table."""
        path = folder / pick(rng, ("log.csv",) * 6 + ("log.tsv", "log.txt", "log.csv.gz"))
        way = int(rng.integers(20))
        if way < 7:
            made, data = "samples", _table(rng, odd_samples(rng, self._data))
        elif way < 9:
            made, data = "header", _table(rng, self._data, odd_header=True)
        elif way < 14:
            made, data = "text", spoiled_text(rng, _table(rng, self._data), _CELLS)
        elif way < 17:
            made, data = "bytes", spoiled_bytes(rng, _table(rng, self._data))
        else:
            made, data = _hostile_table(rng)
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
        channels = ["q", "dq", "ddq"]
        data = {**data, "ddq": data["tau"]}
    header = ["t"] + [f"{channel}_{name}" for channel in channels for name in names]
    columns = [data["t"], *(column for channel in channels for column in data[channel].T)]
    for _ in range(int(rng.integers(1, 4)) if odd_header else 0):
        header[int(rng.integers(len(header)))] = pick(
            rng, (odd_text(rng), pick(rng, header), *_HEADS)
        )
    rows = [separator.join(header)] if chance(rng, 0.97) else []
    form = pick(rng, ("%r", "%.6g", "%.3f"))
    rows += [separator.join(form % float(x) for x in row) for row in np.column_stack(columns)]
    if chance(rng, 0.1):
        rows = [row.replace(".", ",") for row in rows]
    code = pick(rng, ("utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1"))
    text: str = pick(rng, ("\n", "\n", "\r\n", "\r")).join(rows)
    return text.encode(code, "replace")


def _hostile_table(rng: Rng) -> tuple[str, bytes]:
    size, short = large(rng, 6), b"t,q_1,tau_1\n"
    digits = b"1" * size

    def wide(word: str, most: int) -> bytes:
        return ",".join(f"{word}{k}" for k in range(min(size, most))).encode()

    def constant() -> bytes:
        row = b",".join([repr(odd_number(rng)).encode()] * 7) + b"\n"
        return b"t,q_1,q_2,q_3,tau_1,tau_2,tau_3\n" + row * 30

    blank = (b"", b"\n", b" ", b"\0", b",", b"#\n", b"\xef\xbb\xbf")
    heads = b"t,q_shoulder,q_elbow,q_wrist,tau_shoulder,tau_elbow,tau_wrist\n"
    ways: dict[str, Callable[[], bytes]] = {
        "wide header": lambda: wide("q_", 150_000) + b"\n1",
        "long line": lambda: short + digits,
        "blank": lambda: pick(rng, blank) * size,
        "ragged": lambda: short + b"1,2\n1,2,3,4\n" * min(size, 20_000),
        "quotes": lambda: short + b'"' + b'"",' * size,
        "one column": lambda: b"q_1\n" + b"1\n" * min(size, 100_000),
        "constant": constant,
        "binary": lambda: rng.bytes(size),
        "header only": lambda: heads,
        "wide columns": lambda: b"t,q_1,tau_1,%s\n0,0,0\n" % wide("c", 60_000),
        "zeros packed": lambda: short + b"0,0,0\n" * min(10 * size, 400_000),
        "long number": lambda: short + b"0,0,0\n1," + digits + b",1e" + digits[:400] + b"\n",
    }
    return one_of(rng, ways)


class Hdf5Fuzzer(_OfRecording):
    """HDF5: spoiled samples, odd types and shapes, links, bombs, bits."""

    name = "hdf5"

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled file."""
        path = folder / "log.h5"
        way = int(rng.integers(20))
        if way == 19:
            path.write_bytes(b"\x89HDF\r\n\x1a\n" + rng.bytes(int(rng.integers(2000))))
            return path, "binary"
        _write(rng, path, odd_samples(rng, self._data) if way < 6 else self._data)
        if way < 6:
            return path, "samples"
        if way < 11:
            return path, f"structure {_restructured(rng, path)}"
        path.write_bytes(spoiled_bytes(rng, path.read_bytes(), _often(rng)))
        return path, "bytes"

    def enter(self, path: Path) -> None:
        """As measured data."""
        _enter_data(path)


def _often(rng: Rng) -> int:
    return int(pick(rng, (1, 2, 5, 20)))


def _write(rng: Rng, path: Path, data: dict[str, Array]) -> None:
    newest = {"libver": "latest"} if chance(rng, 0.3) else {}
    options = pick(rng, ({}, {}, {"compression": "gzip"}, {"shuffle": True, "fletcher32": True}))
    with h5py.File(path, "w", **newest) as file:
        for run in pick(rng, (("",), ("runs/a",), ("runs/a", "runs/b"), ("runs/a/1",))):
            group = file.require_group(run) if run else file
            for name, array in data.items():
                if name != "dq" or chance(rng, 0.8):
                    group.create_dataset(name, data=array, chunks=bool(options) or None, **options)
            group.attrs["joint_names"] = list(JOINTS)


_REFUSED = (ValueError, TypeError, OSError, RuntimeError, OverflowError, KeyError, MemoryError)


def _restructured(rng: Rng, path: Path) -> str:
    """One or two parts replaced by something else."""
    made = []
    with h5py.File(path, "a") as file:
        for _ in range(int(rng.integers(1, 3))):
            groups: list[Any] = [file]
            file.visititems(
                lambda _, item, g=groups: g.append(item) if isinstance(item, h5py.Group) else None
            )
            name = pick(rng, ("t", "q", "dq", "tau", "runs", "extra", odd_text(rng)))
            with contextlib.suppress(*_REFUSED):  # h5py itself refuses to write it
                made.append(_replaced(rng, path, pick(rng, groups), name))
    return made[0] if made else "nothing"


def _replaced(rng: Rng, path: Path, group: Any, name: str) -> str:
    """Something in place of `name` in a group; in a word what."""
    ways = _parts(rng, path, group, name)
    way: str = pick(rng, list(ways))
    if way != "names" and name and name in group:
        del group[name]
    ways[way]()
    return way


_SHAPES: tuple[tuple[int, ...], ...] = (
    *((), (0,), (1,), (360,), (1,) * 30, (3, 120), (120, 1), (120, 2), (120, 0), (0, 3), (1, 3)),
    *((121, 3), (120, 300), (120, 3, 1)),
)


def _parts(rng: Rng, path: Path, group: Any, name: str) -> dict[str, Callable[[], Any]]:
    """Ways to put something odd at `name`."""
    block, file = (120, 3), group.file
    ones = np.ones(block)

    def put(value: Any) -> None:
        group[name] = value

    def create(shape: tuple[int, ...], **more: Any) -> None:
        group.create_dataset(name, shape, **more)

    def huge() -> None:
        size = pick(rng, (2**31, 2**32 + 1, 10**12, 2**40, 2**62))
        shape = pick(rng, ((size,), (size, 3), (3, size)))
        chunks, filling = pick(rng, (True, (1, 1), None)), pick(rng, (0, 1, None))
        create(shape, dtype=pick(rng, ("f8", "f8", "i1")), chunks=chunks, fillvalue=filling)

    def bomb() -> None:
        """Zeros in gzip: a thousand times as large in memory as on disk."""
        rows = int(pick(rng, (10_000, 300_000)))
        chunks = pick(rng, ((rows, 3), (7, 3)))
        create((rows, 3), data=np.zeros((rows, 3)), compression="gzip", chunks=chunks)

    def all_huge() -> None:
        """Everything of the same size, just below or above what is read, without storage."""
        rows = int(pick(rng, (2**20, 2**24, 2**26, 2**27, 2**30)))
        for key, shape in (("t", (rows,)), ("q", (rows, 3)), ("tau", (rows, 3)), ("x", (rows, 40))):
            if key in group:
                del group[key]
            group.create_dataset(key, shape=shape, dtype="f8", chunks=True)

    def virtual() -> None:
        layout = h5py.VirtualLayout(shape=block, dtype="f8")
        source = pick(rng, ("/etc/passwd", ".", str(path), "%b.h5"))
        layout[:] = h5py.VirtualSource(source, "q", shape=block)
        group.create_virtual_dataset(name, layout)

    def named() -> None:
        group.attrs["joint_names"] = pick(rng, (
            "shoulder", 3, np.zeros(3), [], ["shoulder"] * 3, np.array([b"\xff\xfe", b"a", b"b"]),
            ["shoulder", "elbow"], h5py.Empty("f8"), [odd_text(rng) for _ in range(3)],
            odd_number(rng), np.array(list(JOINTS), "S"), np.array([list(JOINTS)], "S"),
            ["x" * 10_000, "y", "z"], np.zeros(2, [("a", "f8")]), [f"j{k}" for k in range(3000)],
            ["shoulder ", "elbow\0", "wrist\n"],
        ))  # fmt: skip

    def marked() -> None:
        values = ("fit", "diagnosis", "", 3, np.zeros(3), h5py.Empty("i4"), odd_text(rng))
        file.attrs[pick(rng, ("kind", "content", "program", "schema"))] = pick(rng, values)

    def referring() -> None:
        if chance(rng, 0.5):
            references = np.array([group.ref] * 120, dtype=h5py.ref_dtype)
            create((120,), data=references, dtype=h5py.ref_dtype)
        else:
            create((120,), dtype=h5py.vlen_dtype(np.dtype("f8")))
            group[name][0] = [1.0, 2.0]

    def deep() -> None:
        inner = group
        for _ in range(int(pick(rng, (3, 50, 400)))):
            inner = inner.create_group("runs")
        inner["q"] = np.zeros(block)

    def many() -> None:
        runs = file.require_group("runs")
        for number in range(int(pick(rng, (20, 300)))):
            part = runs.require_group(f"{number}")
            part["q"] = part["tau"] = np.zeros((2, 3))

    typed = (
        *(np.full(block, b"text"), np.full(block, 2**63, "u8"), np.full(block, 1e300, "g")),
        *(ones.astype(kind) for kind in ("c16", "i1", "f2", ">f8", "?")),
        *(np.zeros(block, "V7"), np.zeros(120, [("a", "f8"), ("b", "i4")])),
    )
    elsewhere = ["/etc/passwd", "/dev/zero", "../../../../etc/hostname", "/proc/self/mem"]
    linked = (
        *(h5py.SoftLink(to) for to in ("/q", f"/{name}", "/nowhere", ".")),
        *(h5py.ExternalLink(to, "/q") for to in ("/etc/passwd", path.name)),
        *(h5py.ExternalLink(to, "/") for to in ("/dev/zero", "/dev/stdin")),
    )
    out = pick(rng, [*elsewhere, str(path)])
    return {
        "type": lambda: put(pick(rng, typed)),
        "shape": lambda: put(np.zeros(pick(rng, _SHAPES))),
        "huge": huge,
        "bomb": bomb,
        "all huge": all_huge,
        "external": lambda: create(block, dtype="f8", external=[(out, 0, 120 * 24)]),
        "link": lambda: put(pick(rng, linked)),
        "loop": lambda: put(pick(rng, (file["/"], group))),
        "virtual": virtual,
        "names": named,
        "marks": marked,
        "reference": referring,
        "deep": deep,
        "many runs": many,
        "named type": lambda: put(np.dtype("f8")),
        "missing": lambda: None,
    }


_CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
_KINDS = ("result", "fit", "diagnosis")


class ResultFuzzer(Fuzzer):
    """The program's own HDF5, results, fits and diagnoses, spoiled in records, arrays and bytes.

    The entries are those of `report`, `check`, `export`, `--prior`, `--after` and
    `uncertainty.fit`.
    """

    name = "results"

    def prepare(self, bases: Path) -> None:
        """A short loop on the small arm: plan, simulate, identify, diagnose."""
        problem = load_problem(_CONFIG, ["optimizer.max_iterations=4", "diagnosis.rounds=2"])
        result = plan(problem)
        write_result(bases / "result.h5", result, problem)
        data = simulate(problem, result, ["coulomb_friction@elbow=3"]).dataset
        save_fit(bases / "fit.h5", problem, identify(problem, data))
        diagnose(problem, data, output=bases / "diagnosis.h5")

    def open(self, bases: Path) -> None:
        """The files' bytes."""
        self._data = {kind: (bases / f"{kind}.h5").read_bytes() for kind in _KINDS}

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled file."""
        kind = pick(rng, _KINDS)
        path = folder / "stored.h5"
        if int(rng.integers(10)) < 4:
            path.write_bytes(spoiled_bytes(rng, self._data[kind], _often(rng)))
            return path, f"bytes of {kind}"
        path.write_bytes(self._data[kind])
        made = "nothing"
        with h5py.File(path, "a") as file:
            for _ in range(int(rng.integers(1, 3))):
                with contextlib.suppress(*_REFUSED):  # h5py itself refuses to write it
                    made = _spoiled_record(rng, path, file)
        return path, f"{made} of {kind}"

    def enter(self, path: Path) -> None:
        """As a report reads it; motions are sampled too."""
        content = read_files([path])[0].content
        if isinstance(content, Result):
            read_samples(path)
            for motion in motions_of(content, name=str(path)):
                motion.trajectory.states(np.linspace(0, 1, 5), motion.coefficients)


def _spoiled_record(rng: Rng, path: Path, file: Any) -> str:
    items: list[Any] = [file]
    file.visititems(lambda _, item: items.append(item))
    item = pick(rng, items)
    if item.attrs and chance(rng, 0.5):
        _spoil_attribute(rng, item)
        return "attribute"
    if isinstance(item, h5py.Group):
        return _replaced(rng, path, item, pick(rng, list(item) or ["x"]))
    if isinstance(item, h5py.Dataset) and item.nbytes <= 10**8:  # larger made so by an earlier one
        _spoil_array(rng, path, item)
    return "array"


def _spoil_attribute(rng: Rng, item: Any) -> None:
    key = pick(rng, list(item.attrs))
    value = item.attrs[key]
    way = int(rng.integers(6))
    if way == 0:
        del item.attrs[key]
    elif isinstance(value, str) and value[:1] in "{[" and way < 5:
        item.attrs[key] = json.dumps(spoiled_tree(rng, json.loads(value)))
    elif way == 1:
        item.attrs[key] = pick(rng, (odd_text(rng), "[" * 100_000, '{"a": ' * 3000, "9" * 5000))
    elif way == 2:
        item.attrs[key] = odd_number(rng)
    elif way == 3:
        item.attrs[key] = pick(rng, (h5py.Empty("f8"), np.zeros(0), np.zeros((2, 2)), b"\xff"))
    else:
        item.attrs[key] = json.dumps(odd_value(rng))


def _spoil_array(rng: Rng, path: Path, item: Any) -> None:
    parent, name, value = item.parent, item.name.rsplit("/", 1)[1], item[()]
    if isinstance(value, bytes) and value[:1] in b"{[" and chance(rng, 0.8):
        new: Any = json.dumps(spoiled_tree(rng, json.loads(value)))
    elif np.size(value) and np.asarray(value).dtype.kind == "f" and chance(rng, 0.6):
        new = np.array(value, dtype=float)
        new.flat[int(rng.integers(new.size))] = float(odd_number(rng))
        if new.ndim and chance(rng, 0.5):
            new = pick(rng, (new[:-1], new.T, new[None], new.ravel(), new * np.nan))
    else:
        _replaced(rng, path, parent, name)
        return
    del parent[name]
    parent[name] = new


_JOINT_STATE = "sensor_msgs/msg/JointState"
_EPOCH = 1_700_000_000_000_000_000
_TYPES = ("", _JOINT_STATE, "sensor_msgs/msg/Image", "std_msgs/msg/String", "x", "a/b/c/d",
          "trajectory_msgs/msg/JointTrajectory", "sensor_msgs/JointState")  # fmt: skip
_HEADERS = (b"SQLite format 3\0", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n", b"")


class BagFuzzer(_OfRecording):
    """ROS bags of rosbag2 (both storages) and ROS 1: databases, messages, metadata and bytes."""

    name = "bags"

    def prepare(self, bases: Path) -> None:
        """A bag of each storage."""
        from rosbags import rosbag1, rosbag2
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.typesys import Stores, get_typestore

        for name, storage in (("sqlite", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
            store = get_typestore(Stores.ROS2_HUMBLE)
            with rosbag2.Writer(bases / name, version=9, storage_plugin=storage) as writer:
                _play(writer, store, store.serialize_cdr, first=False)
        store = get_typestore(Stores.ROS1_NOETIC)
        with rosbag1.Writer(bases / "ros1.bag") as writer:
            _play(writer, store, store.serialize_ros1, first=True)

    def open(self, bases: Path) -> None:
        """The bags' bytes."""
        self._folders = (bases / "sqlite", bases / "mcap")
        self._files = [f for d in self._folders for f in d.iterdir() if f.suffix != ".yaml"]
        self._files.append(bases / "ros1.bag")

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled bag: a file alone, or a folder with its metadata."""
        way = int(rng.integers(20))
        if way < 13 or way == 17:
            chosen = [f for f in self._files if not 8 <= way < 13 or f.suffix == ".db3"]
            file = pick(rng, chosen)
            path, data = folder / f"log{file.suffix}", file.read_bytes()
            if way < 8:
                data = spoiled_bytes(rng, data, int(pick(rng, (1, 2, 5, 30))))
            elif way == 17:
                data = data[: int(rng.integers(len(data) + 1))]
            path.write_bytes(data)
            if way < 8 or way == 17:
                return path, f"{'bytes of' if way < 8 else 'cut'} {file.suffix}"
            return path, f"database {_spoil_database(rng, path)}"
        if way < 17:
            path = folder / "log"
            shutil.copytree(pick(rng, self._folders), path)
            return path, _spoil_metadata(rng, path)
        path = folder / f"log{pick(rng, ('.db3', '.mcap', '.bag'))}"
        path.write_bytes(pick(rng, _HEADERS) + rng.bytes(int(rng.integers(3000))))
        return path, "binary"


def _play(writer: Any, store: Any, serialize: Callable[..., Any], first: bool) -> None:
    """Write the messages of a motion; `first`: as ROS 1 has them."""
    types, data = store.types, recorded(np.random.default_rng(0), 60)
    connection = writer.add_connection("/joint_states", _JOINT_STATE, typestore=store)
    for k, t in enumerate(data["t"]):
        stamp = _EPOCH + round(t * 1e9)
        time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
        number = {"seq": k} if first else {}
        header = types["std_msgs/msg/Header"](stamp=time, frame_id="", **number)
        values = (data[name][k] for name in ("q", "dq", "tau"))
        message = types[_JOINT_STATE](header, list(JOINTS), *values)
        writer.write(connection, stamp, serialize(message, _JOINT_STATE))


_COMMANDS = (
    "INSERT INTO topics SELECT id+1, '/other', type, serialization_format, "
    "offered_qos_profiles, '' FROM topics",
    "DELETE FROM messages",
    "DELETE FROM topics",
    "UPDATE messages SET topic_id=99",
    "CREATE VIEW v AS SELECT * FROM messages, messages",
    "UPDATE schema SET schema_version=9",
    "UPDATE schema SET schema_version='x'",
    "UPDATE topics SET id=-1",
    "CREATE TRIGGER t AFTER INSERT ON topics BEGIN DELETE FROM messages; END",
)


def _spoil_database(rng: Rng, path: Path) -> str:
    """Rows and tables of sqlite changed; messages with wrong lengths and garbage."""

    def messages() -> None:
        for number in rng.integers(1, 61, int(pick(rng, (1, 5, 60)))).tolist():
            row = database.execute("SELECT data FROM messages WHERE id=?", (number,)).fetchone()
            data = _spoiled_message(rng, row[0] if row else b"")
            database.execute("UPDATE messages SET data=? WHERE id=?", (data, number))

    def stamps() -> None:
        stamp = pick(rng, (0, -1, 2**62, -(2**63), 2**63 - 1, 1.5, "x", None))
        values = (stamp, int(rng.integers(1, 61)))
        database.execute("UPDATE messages SET timestamp=? WHERE id>=?", values)

    def topics() -> None:
        name = pick(rng, ("type", "name", "serialization_format", "offered_qos_profiles"))
        value = pick(rng, (pick(rng, _TYPES), odd_text(rng), None, 3, b"x"))
        database.execute(f"UPDATE topics SET {name}=?", (value,))

    def types() -> None:
        value = pick(rng, ("text", 5, None, 1.5, b"", "x" * 10_000))
        database.execute("UPDATE messages SET data=?", (value,))

    tables = ("messages", "topics", "metadata", "schema", "message_definitions")
    ways: dict[str, Callable[[], Any]] = {
        "messages": messages,
        "other messages": messages,
        "stamps": stamps,
        "topics": topics,
        "dropped table": lambda: database.execute(f"DROP TABLE {pick(rng, tables)}"),
        "message types": types,
        "tables": lambda: database.execute(pick(rng, _COMMANDS)),
    }
    way: str = pick(rng, list(ways))
    database = sqlite3.connect(path, isolation_level=None)
    # The database itself may refuse to hold it.
    with contextlib.suppress(sqlite3.Error, OverflowError, UnicodeEncodeError):
        ways[way]()
    database.close()
    return way


def _spoiled_message(rng: Rng, data: bytes) -> bytes:
    raw = bytearray(data)
    way = int(rng.integers(4))
    if way == 0 and len(raw) > 32:
        # A length in the message claims more than is there.
        at = 4 * int(rng.integers(1, len(raw) // 4))
        raw[at : at + 4] = int(pick(rng, (2**31, 2**32 - 1, 2**24, 5, 0))).to_bytes(4, "little")
        return bytes(raw)
    if way == 1 and len(raw) > 32:
        at = len(raw) - 8 * int(rng.integers(1, 10))
        raw[at : at + 8] = np.float64(odd_number(rng) if chance(rng, 0.9) else 1.0).tobytes()
        return bytes(raw)
    return spoiled_bytes(rng, data)


def _spoil_metadata(rng: Rng, path: Path) -> str:
    file = path / "metadata.yaml"
    text = file.read_bytes()
    store = next(f.name for f in path.iterdir() if f.suffix != ".yaml").encode()
    others = (odd_text(rng).encode("utf-8", "replace"), b"", *(
        b"../../../etc/passwd /etc/passwd /dev/zero . metadata.yaml".split()
    ))  # fmt: skip
    levels = b"".join(
        b"%c: &%c [%s]\n" % (98 + k, 98 + k, b", ".join([b"*%c" % (97 + k)] * 9)) for k in range(9)
    )
    words = b"zstd file message sqlite3 mcap -1".split()
    odd = (b"", b"[" * 5000, b"a: " * 5000, b"!!python/object/apply:os.system [id]", b"\0")
    ways: dict[str, Callable[[], bytes]] = {
        "metadata bytes": lambda: spoiled_bytes(rng, text),
        "metadata file": lambda: text.replace(store, pick(rng, others)),
        "metadata bomb": lambda: b"a: &a [x, x, x, x, x, x, x, x, x]\n" + levels + text,
        "odd metadata": lambda: pick(rng, odd),
        "metadata text": lambda: spoiled_text(rng, text, words),
    }
    made, data = one_of(rng, ways)
    file.write_bytes(data)
    return made


_WORDS = """
joint_names points positions velocities accelerations time_from_start sec nanosec secs nsecs
joint_trajectory effort
"""


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
        path = folder / f"motion.{kind}"
        way = int(rng.integers(10))
        if kind == "npz":
            made, data = _archive(rng, self._data)
        elif way == 9:
            made, data = _hostile_motion(rng)
        else:
            made = "tree" if way < 6 else "text" if way < 8 else "bytes"
            tree = self._tree if kind == "yaml" else {"joint_trajectory": self._tree}
            text = json.dumps(spoiled_tree(rng, tree, _WORDS.split()) if made == "tree" else tree)
            if kind == "yaml":  # which JSON is too
                text = text.replace("Infinity", ".inf").replace("NaN", ".nan")
            data = text.encode("utf-8", "replace")
            if made != "tree":
                data = (spoiled_text if made == "text" else spoiled_bytes)(rng, data)
        path.write_bytes(data)
        return path, f"{made} {kind}"

    def enter(self, path: Path) -> None:
        """As `check` and `view` read it."""
        if not _enter_motion(path):
            raise FileError(f"{path} is no motion")


def _hostile_motion(rng: Rng) -> tuple[str, bytes]:
    size = large(rng, 6)
    one, many = b'{"joint_names": ["a"], "points": [', min(size, 200_000)
    point = b'{"positions": [1e%s], "time_from_start": {"sec": %s, "nanosec": 0}}'
    ways: dict[str, Callable[[], bytes]] = {
        "depth": lambda: pick(rng, (b"[", b'{"a":')) * size,
        "blank": lambda: pick(rng, (b" " * size, b"")),
        "number of names": lambda: b'{"joint_names": [' + b"9" * size + b"]}",
        "long number": lambda: one + point % (b"9" * min(size, 10**4), b"9" * min(size, 4000)),
        "many": lambda: one + b"{}," * many + b"{}]}",
        "alias": lambda: b"joint_names: &a [x]\npoints: *a",
        "bomb": lambda: b"a: &a [x,x]\nb: &b [*a,*a]\nc: [*b,*b]",
        "many names": lambda: b'{"joint_names": [' + b'"a",' * many + b'"b"], "points": [{}]}',
    }
    return one_of(rng, ways)


_CLAIMS = (
    "(1000000000000,)", "(0,)", "(-1,)", "(40,3,10**9)", "(4,)*99999", "()", "(2**62, 4)",
    "('a',)", "__import__('os')", "(" * 500, "(40, 3)", "(1.5,)", "(True,)",
)  # fmt: skip
_CLAIMED = [
    "'<f8'",
    "'O'",
    "'|V0'",
    "'<U0'",
    "'<U999999999'",
    "[('a','<f8')]",
    "'x'",
    "'<f8'",
    "'>i4'",
]


def _archive(rng: Rng, data: dict[str, Any]) -> tuple[str, bytes]:
    arrays = {"t": data["t"], "q": data["q"], "v": data["dq"], "joint_names": np.array(JOINTS)}
    block = (40, 3)

    def packed(**changed: Any) -> bytes:
        buffer = io.BytesIO()
        pick(rng, (np.savez, np.savez_compressed))(buffer, **(arrays | changed))
        return buffer.getvalue()

    def samples() -> bytes:
        odd = odd_samples(rng, data)
        return packed(t=odd["t"], q=odd["q"], v=odd["dq"])

    odd = (
        *(np.zeros(block, kind) for kind in ("c16", "M8[s]")),
        *(np.zeros(shape) for shape in ((0,), (), (3, 40), (40, 3, 1))),
        *(np.array(["a"] * 40), np.array([{}] * 40, dtype=object), np.zeros(40, "V8")),
    )
    rows = int(pick(rng, (10**4, 10**6, 5 * 10**6)))
    ways: dict[str, Callable[[], bytes]] = {
        "samples": samples,
        "other samples": samples,
        "array": lambda: packed(**{pick(rng, list(arrays)): pick(rng, odd)}),
        "bytes": lambda: spoiled_bytes(rng, packed()),
        "header": lambda: _odd_header(rng),
        # A thousand times as large in memory as on disk.
        "bomb": lambda: packed(t=np.arange(40.0), q=np.zeros((rows, 3))),
    }
    return one_of(rng, ways)


def _odd_header(rng: Rng) -> bytes:
    """`.npy` members whose headers claim other shapes and types than there are."""
    versions = ((b"\x01\x00", 2), (b"\x02\x00", 4), (b"\x03\x00", 4), (b"\x09\x00", 4))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("t", "q", "joint_names"):
            text = f"{{'descr': {pick(rng, _CLAIMED)}, 'fortran_order': False, "
            header = f"{text}'shape': {pick(rng, _CLAIMS)}, }}\n".encode()
            version, width = pick(rng, versions)
            length = (len(header) if chance(rng, 0.9) else 2**15).to_bytes(width, "little")
            content = b"\x93NUMPY" + version + length + header + b"\0" * 400
            archive.writestr(f"{name}.npy", content)
    return buffer.getvalue()
