"""HDF5 as inputs: measured data, and the program's own results, fits and diagnoses.

Structured files are made with h5py; shapes without storage claim what no machine holds.
"""

import contextlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from benchmarks.trust.data_files import JOINTS, OfRecording, enter_data
from benchmarks.trust.mutations import (
    Rng,
    chance,
    odd_samples,
    odd_text,
    pick,
    spoiled_bytes,
    spoiled_tree,
)
from benchmarks.trust.trial import Fuzzer
from excite_cli import diagnose, identify, load_problem, motions_of, plan, save_fit, simulate
from excite_cli.api.reporting import read_files
from excite_cli.excitation.result import Result
from excite_cli.measurement.dataset import Array
from excite_cli.store.result_file import read_samples, write_result
from tests.store.mutations import mutations


class Hdf5Fuzzer(OfRecording):
    """HDF5: spoiled samples, odd types and shapes, links, claims without storage, bits."""

    name = "hdf5"

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled file."""
        path, way = folder / "log.h5", int(rng.integers(20))
        if way == 19:
            path.write_bytes(b"\x89HDF\r\n\x1a\n" + rng.bytes(int(rng.integers(2000))))
            return path, "binary"
        _write(rng, path, odd_samples(rng, self._data) if way < 6 else self._data)
        if way < 6:
            return path, "samples"
        if way < 11:
            return path, _restructured(rng, path)
        path.write_bytes(spoiled_bytes(rng, path.read_bytes(), pick(rng, (1, 2, 5, 20))))
        return path, "bytes"

    def enter(self, path: Path) -> None:
        """As measured data."""
        enter_data(path)


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
    """One or two parts replaced by something odd; in a word by what."""
    made = "nothing"
    with h5py.File(path, "a") as file:
        for _ in range(int(rng.integers(1, 3))):
            groups: list[Any] = [file]
            file.visititems(
                lambda _, item, g=groups: g.append(item) if isinstance(item, h5py.Group) else None
            )
            name = pick(rng, ("t", "q", "dq", "tau", "runs", "extra", odd_text(rng)))
            with contextlib.suppress(*_REFUSED):  # h5py itself refuses to write it
                made = _replaced(rng, pick(rng, groups), name)
    return made


_BLOCK, _SIZES = (120, 3), (2**20, 2**24, 2**27, 2**31, 2**32 + 1, 10**12, 2**40, 2**62)
_SHAPES: tuple[tuple[int, ...], ...] = (
    *((), (0,), (1,), (360,), (1,) * 30, (3, 120), (120, 1), (120, 2), (120, 0), (0, 3), (1, 3)),
    *((121, 3), (120, 300), (120, 3, 1)),
)
_VALUES = (
    *(np.full(_BLOCK, b"text"), np.full(_BLOCK, 2**63, "u8"), np.full(_BLOCK, 1e300, "g")),
    *(np.ones(_BLOCK).astype(kind) for kind in ("c16", "i1", "f2", ">f8", "?")),
    *(np.zeros(_BLOCK, "V7"), np.zeros(120, [("a", "f8"), ("b", "i4")]), np.dtype("f8")),
    *(h5py.SoftLink(to) for to in ("/q", "/t", "/nowhere", ".")),
    *(h5py.ExternalLink(to, "/") for to in ("/etc/passwd", "/dev/zero", "/dev/stdin", "log.h5")),
)
_ELSEWHERE = ("/etc/passwd", "/dev/zero", "../../../../etc/hostname", "/proc/self/mem", ".")
_NAMES = (
    *("shoulder", 3, np.zeros(3), [], ["shoulder"] * 3, np.array([b"\xff\xfe", b"a", b"b"])),
    *(["shoulder", "elbow"], h5py.Empty("f8"), np.array(list(JOINTS), "S"), ["x" * 10_000, "y"]),
    *(np.zeros(2, [("a", "f8")]), [f"j{k}" for k in range(3000)], ["shoulder ", "elbow\0", "w\n"]),
)


def _replaced(rng: Rng, group: Any, name: str) -> str:
    """Something odd in place of `name` in a group, or beside it; in a word what."""
    file = group.file

    def put(value: Any) -> None:
        group[name] = value

    def claim() -> None:
        """Without storage; all of the same size at times, just below or above what is read."""
        rows, alike = int(pick(rng, _SIZES)), {"t": (), "q": (3,), "tau": (3,), "x": (40,)}
        for key, rest in (alike if chance(rng, 0.5) else {name: pick(rng, ((), (3,)))}).items():
            if key in group:
                del group[key]
            group.create_dataset(key, (rows, *rest), "f8", chunks=pick(rng, (True, None)))

    def pack() -> None:
        """Zeros in gzip: a thousand times as large in memory as on disk."""
        rows = int(pick(rng, (10_000, 300_000)))
        chunks = pick(rng, ((rows, 3), (7, 3)))
        group.create_dataset(name, (rows, 3), "f8", np.zeros((rows, 3)), compression="gzip",
                             chunks=chunks)  # fmt: skip

    def virtual() -> None:
        layout = h5py.VirtualLayout(shape=_BLOCK, dtype="f8")
        layout[:] = h5py.VirtualSource(pick(rng, (*_ELSEWHERE, "%b.h5")), "q", shape=_BLOCK)
        group.create_virtual_dataset(name, layout)

    def mark() -> None:
        values = ("fit", "diagnosis", "", 3, np.zeros(3), h5py.Empty("i4"), odd_text(rng))
        file.attrs[pick(rng, ("kind", "content", "program", "schema"))] = pick(rng, values)

    def nest() -> None:
        inner = group
        for _ in range(int(pick(rng, (3, 50, 400)))):
            inner = inner.create_group("runs")
        inner["q"] = np.zeros(_BLOCK)

    ways: dict[str, Callable[[], Any]] = {
        "value": lambda: put(pick(rng, _VALUES)),
        "shape": lambda: put(np.zeros(pick(rng, _SHAPES))),
        "claim": claim,
        "packed": pack,
        "external": lambda: group.create_dataset(
            name, _BLOCK, "f8", external=[(pick(rng, _ELSEWHERE), 0, 120 * 24)]
        ),
        "loop": lambda: put(pick(rng, (file["/"], group))),
        "virtual": virtual,
        "names": lambda: group.attrs.__setitem__("joint_names", pick(rng, _NAMES)),
        "marks": mark,
        "reference": lambda: put(np.array([group.ref] * 120, dtype=h5py.ref_dtype)),
        "nested": nest,
        "missing": lambda: None,
    }
    way: str = pick(rng, list(ways))
    if way != "names" and name and name in group:
        del group[name]
    ways[way]()
    return way


_CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"


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
        """The files, their bytes, and the ways to spoil one part of each."""
        self._files = [bases / f"{kind}.h5" for kind in ("result", "fit", "diagnosis")]
        self._data = {file: file.read_bytes() for file in self._files}
        self._parts = {file: list(mutations(file)) for file in self._files}

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled file."""
        base, path = pick(rng, self._files), folder / "stored.h5"
        way = int(rng.integers(4))
        if way == 0:
            part = pick(rng, self._parts[base])
            part.apply(base, path)
            return path, f"{part.name} of {base.stem}"
        spoil = way == 1
        data = self._data[base]
        path.write_bytes(data if spoil else spoiled_bytes(rng, data, pick(rng, (1, 2, 5, 20))))
        if spoil:
            _spoil_records(rng, path)
        return path, f"{'records' if spoil else 'bytes'} of {base.stem}"

    def enter(self, path: Path) -> None:
        """As a report reads it; motions are sampled too."""
        content = read_files([path])[0].content
        if isinstance(content, Result):
            read_samples(path)
            for motion in motions_of(content, name=str(path)):
                motion.trajectory.states(np.linspace(0, 1, 5), motion.coefficients)


def _spoil_records(rng: Rng, path: Path) -> None:
    """Values within one or two of the records, which are JSON."""
    with h5py.File(path, "a") as file:
        records: list[tuple[Any, str]] = []

        def note(_: str, item: Any) -> None:
            records.extend((item.attrs, key) for key in item.attrs)
            records.append((item.parent, item.name.rsplit("/", 1)[1]))

        file.visititems(note)
        records.extend((file.attrs, key) for key in file.attrs)
        texts = [(*each, _text(*each)) for each in records]
        texts = [each for each in texts if each[2][:1] in ("{", "[")]
        for holder, key, text in (pick(rng, texts) for _ in range(int(rng.integers(1, 3)))):
            del holder[key]
            holder[key] = json.dumps(spoiled_tree(rng, json.loads(text)))


def _text(holder: Any, key: str) -> str:
    value = holder[key]
    value = value[()] if isinstance(value, h5py.Dataset) else value
    return value.decode() if isinstance(value, bytes) else value if isinstance(value, str) else ""
