"""HDF5 of measured data: spoiled samples, odd types and shapes, links, bombs, bits.

Structured inputs are made with h5py; shapes without storage claim what no machine holds.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from benchmarks.trust.fuzz_mutations import (
    Rng,
    chance,
    odd_number,
    odd_text,
    pick,
    spoiled_bytes,
)
from benchmarks.trust.fuzz_recordings import JOINTS, enter_data, odd_samples, recorded
from benchmarks.trust.fuzz_trial import Fuzzer
from excite_cli.measurement.dataset import Array

_HUGE = (2**31, 2**32 + 1, 10**12, 2**40, 2**62)


class Hdf5Fuzzer(Fuzzer):
    """HDF5."""

    name = "hdf5"

    def open(self, bases: Path) -> None:
        """One recording, for all."""
        self._data = recorded(np.random.default_rng(0))

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled file."""
        path = folder / "log.h5"
        way = int(rng.integers(20))
        if way < 6:
            made = "samples"
            _write(rng, path, odd_samples(rng, self._data))
        elif way < 11:
            made = f"structure {_spoil(rng, path, self._data)}"
        elif way < 19:
            made = "bytes"
            _write(rng, path, self._data)
            path.write_bytes(spoiled_bytes(rng, path.read_bytes(), _often(rng)))
        else:
            made = "binary"
            path.write_bytes(b"\x89HDF\r\n\x1a\n" + rng.bytes(int(rng.integers(2000))))
        return path, made

    def enter(self, path: Path) -> None:
        """As measured data."""
        enter_data(path)


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


def _spoil(rng: Rng, path: Path, data: dict[str, Array]) -> str:
    """One or two parts replaced by something else."""
    _write(rng, path, data)
    made = []
    with h5py.File(path, "a") as file:
        for _ in range(int(rng.integers(1, 3))):
            groups: list[Any] = [file]
            file.visititems(
                lambda _, item, g=groups: g.append(item) if isinstance(item, h5py.Group) else None
            )
            group = pick(rng, groups)
            name = pick(rng, ("t", "q", "dq", "tau", "runs", "extra", odd_text(rng)))
            way = pick(rng, list(_WAYS))
            try:
                if name and name in group and way != "names":
                    del group[name]
                _WAYS[way](rng, path, group, name)
            except (ValueError, TypeError, OSError, RuntimeError, OverflowError, KeyError):
                continue  # h5py itself refuses to write it
            made.append(way)
    return made[0] if made else "nothing"


def _typed(rng: Rng, path: Path, group: Any, name: str) -> None:
    kinds: list[Any] = [
        np.full((120, 3), b"text"),
        np.zeros((120, 3), complex),
        np.zeros((120, 3), "i1"),
        np.zeros((120, 3), "f2"),
        np.zeros((120, 3), ">f8"),
        np.ones((120, 3), bool),
        np.zeros(120, [("a", "f8"), ("b", "i4")]),
        np.full((120, 3), 2**63, "u8"),
        np.zeros((120, 3), "V7"),
        np.full((120, 3), 1e300, np.longdouble),
    ]
    group[name] = pick(rng, kinds)


def _shaped(rng: Rng, path: Path, group: Any, name: str) -> None:
    shapes = (
        (),
        (0,),
        (1,),
        (3, 120),
        (120, 1),
        (120, 2),
        (120, 3, 1),
        (120, 0),
        (0, 3),
        (1, 3),
        (1,) * 30,
        (360,),
        (121, 3),
        (120, 300),
    )
    group[name] = np.zeros(pick(rng, shapes))


def _huge(rng: Rng, path: Path, group: Any, name: str) -> None:
    size = pick(rng, _HUGE)
    kind = pick(rng, ("f8", "f8", "i1"))
    group.create_dataset(
        name,
        shape=pick(rng, ((size,), (size, 3), (3, size))),
        dtype=kind,
        chunks=pick(rng, (True, (1, 1), None)),
        fillvalue=pick(rng, (0, 1, None)),
    )


def _bomb(rng: Rng, path: Path, group: Any, name: str) -> None:
    """Zeros in gzip: a thousand times as large in memory as on disk, in one or in many chunks."""
    rows = int(pick(rng, (10_000, 300_000)))
    group.create_dataset(
        name, data=np.zeros((rows, 3)), compression="gzip", chunks=pick(rng, ((rows, 3), (7, 3)))
    )


def _all_huge(rng: Rng, path: Path, group: Any, name: str) -> None:
    """Everything of the same size, just below or above what is read, without storage."""
    rows = int(pick(rng, (2**20, 2**24, 2**26, 2**27, 2**30)))
    for key, shape in (("t", (rows,)), ("q", (rows, 3)), ("tau", (rows, 3)), ("x", (rows, 40))):
        if key in group:
            del group[key]
        group.create_dataset(key, shape=shape, dtype="f8", chunks=True)


def _external(rng: Rng, path: Path, group: Any, name: str) -> None:
    other = pick(
        rng, ("/etc/passwd", "/dev/zero", "../../../../etc/hostname", str(path), "/proc/self/mem")
    )
    group.create_dataset(name, (120, 3), "f8", external=[(other, 0, 120 * 24)])


def _linked(rng: Rng, path: Path, group: Any, name: str) -> None:
    links = (
        h5py.SoftLink("/q"),
        h5py.SoftLink(f"/{name}"),
        h5py.SoftLink("/nowhere"),
        h5py.SoftLink("."),
        h5py.ExternalLink("/etc/passwd", "/q"),
        h5py.ExternalLink("/dev/zero", "/"),
        h5py.ExternalLink(path.name, "/q"),
        h5py.ExternalLink("/dev/stdin", "/"),
    )
    group[name] = pick(rng, links)


def _looped(rng: Rng, path: Path, group: Any, name: str) -> None:
    group[name] = group.file["/"] if chance(rng, 0.5) else group


def _virtual(rng: Rng, path: Path, group: Any, name: str) -> None:
    layout = h5py.VirtualLayout(shape=(120, 3), dtype="f8")
    source = pick(rng, ("/etc/passwd", ".", str(path), "%b.h5"))
    layout[:] = h5py.VirtualSource(source, "q", shape=(120, 3))
    group.create_virtual_dataset(name, layout)


def _named(rng: Rng, path: Path, group: Any, name: str) -> None:
    names: tuple[Any, ...] = (
        "shoulder",
        3,
        np.zeros(3),
        [],
        ["shoulder"] * 3,
        np.array([b"\xff\xfe", b"a", b"b"]),
        ["shoulder", "elbow"],
        h5py.Empty("f8"),
        [odd_text(rng) for _ in range(3)],
        odd_number(rng),
        np.array(list(JOINTS), "S"),
        np.array([list(JOINTS)], "S"),
        ["x" * 10_000, "y", "z"],
        np.zeros(2, [("a", "f8")]),
        [f"j{k}" for k in range(3000)],
        ["shoulder ", "elbow\0", "wrist\n"],
    )
    group.attrs["joint_names"] = pick(rng, names)


def _marked(rng: Rng, path: Path, group: Any, name: str) -> None:
    values = ("fit", "diagnosis", "", 3, np.zeros(3), h5py.Empty("i4"), odd_text(rng))
    group.file.attrs[pick(rng, ("kind", "content", "program", "schema"))] = pick(rng, values)


def _referring(rng: Rng, path: Path, group: Any, name: str) -> None:
    data = np.array([group.ref] * 120, dtype=h5py.ref_dtype)
    kind = h5py.vlen_dtype(np.dtype("f8"))
    if chance(rng, 0.5):
        group.create_dataset(name, data=data, dtype=h5py.ref_dtype)
    else:
        group.create_dataset(name, (120,), dtype=kind)[0] = [1.0, 2.0]


def _deep(rng: Rng, path: Path, group: Any, name: str) -> None:
    for _ in range(int(pick(rng, (3, 50, 400)))):
        group = group.create_group("runs")
    group["q"] = np.zeros((120, 3))


def _many(rng: Rng, path: Path, group: Any, name: str) -> None:
    runs = group.file.require_group("runs")
    for number in range(int(pick(rng, (20, 300)))):
        part = runs.require_group(f"{number}")
        part["q"] = part["tau"] = np.zeros((2, 3))


def _typed_name(rng: Rng, path: Path, group: Any, name: str) -> None:
    group[name] = np.dtype("f8")


def _missing(rng: Rng, path: Path, group: Any, name: str) -> None:
    """It has been deleted."""


_WAYS = {
    "type": _typed,
    "shape": _shaped,
    "huge": _huge,
    "bomb": _bomb,
    "all huge": _all_huge,
    "external": _external,
    "link": _linked,
    "loop": _looped,
    "virtual": _virtual,
    "names": _named,
    "marks": _marked,
    "reference": _referring,
    "deep": _deep,
    "many runs": _many,
    "named type": _typed_name,
    "missing": _missing,
}
