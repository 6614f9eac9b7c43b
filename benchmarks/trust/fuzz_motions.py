"""Motions as controllers' files: JSON of MoveIt, YAML of ROS 2, NumPy archives."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trust.fuzz_mutations import (
    Rng,
    pick,
    spoiled_bytes,
    spoiled_text,
    spoiled_tree,
)
from benchmarks.trust.fuzz_recordings import JOINTS, enter_motion, odd_samples, recorded
from benchmarks.trust.fuzz_trial import Fuzzer
from excite_cli.errors import FileError

_KEYS = (
    "joint_names",
    "points",
    "positions",
    "velocities",
    "accelerations",
    "time_from_start",
    "sec",
    "nanosec",
    "secs",
    "nsecs",
    "joint_trajectory",
    "effort",
)


class MotionFuzzer(Fuzzer):
    """Motion files."""

    name = "motions"

    def open(self, bases: Path) -> None:
        """One motion, for all."""
        self._data = recorded(np.random.default_rng(0), 40)
        self._tree = _tree(self._data, 12)

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled motion."""
        kind = pick(rng, ("json", "yaml", "npz"))
        path = folder / f"motion.{kind}"
        way = int(rng.integers(10))
        if kind == "npz":
            made, data = _archive(rng, self._data, way)
        else:
            tree = self._tree if kind == "yaml" else {"joint_trajectory": self._tree}
            if way < 6:
                made, tree = "tree", spoiled_tree(rng, tree, _KEYS)
            text = json.dumps(tree)  # which is YAML too
            if kind == "yaml":
                text = text.replace("Infinity", ".inf").replace("NaN", ".nan")
            data = text.encode("utf-8", "replace")
            if way in (6, 7):
                made, data = "text", spoiled_text(rng, data)
            elif way == 8:
                made, data = "bytes", spoiled_bytes(rng, data)
            elif way == 9:
                made, data = _hostile(rng)
        path.write_bytes(data)
        return path, f"{made} {kind}"

    def enter(self, path: Path) -> None:
        """As `check` and `view` read it."""
        if not enter_motion(path):
            raise FileError(f"{path} is no motion")


def _tree(data: dict[str, Any], count: int) -> dict[str, Any]:
    points = []
    for k in range(count):
        stamp = {"sec": 0, "nanosec": round(data["t"][k] * 1e9)}
        states = {"positions": data["q"][k].tolist(), "velocities": data["dq"][k].tolist()}
        points.append({**states, "time_from_start": stamp})
    return {"joint_names": list(JOINTS), "points": points}


def _hostile(rng: Rng) -> tuple[str, bytes]:
    size = int(10 ** rng.uniform(1, 6))
    return pick(
        rng,
        (
            ("depth", b"[" * size),
            ("depth", b'{"a":' * size),
            ("blank", b" " * size),
            ("blank", b""),
            ("long number", b'{"joint_names": [' + b"9" * size + b"]}"),
            (
                "long number",
                b'{"joint_names": ["a"], "points": [{"positions": [1e'
                + b"9" * min(size, 10**4)
                + b'], "time_from_start": {"sec": '
                + b"9" * min(size, 4000)
                + b', "nanosec": 0}}]}',
            ),
            ("many", b'{"joint_names": ["a"], "points": [' + b"{}," * min(size, 200_000) + b"{}]}"),
            ("alias", b"joint_names: &a [x]\npoints: *a"),
            ("bomb", b"a: &a [x,x]\nb: &b [*a,*a]\nc: [*b,*b]"),
            (
                "many names",
                b'{"joint_names": [' + b'"a",' * min(size, 200_000) + b'"b"], "points": [{}]}',
            ),
        ),
    )


def _archive(rng: Rng, data: dict[str, Any], way: int) -> tuple[str, bytes]:
    arrays: dict[str, Any] = {"t": data["t"], "q": data["q"], "v": data["dq"]}
    arrays["joint_names"] = np.array(JOINTS)
    if way < 4:
        changed = odd_samples(rng, data)
        arrays |= {"t": changed["t"], "q": changed["q"], "v": changed["dq"]}
    elif way == 4:
        odd = (
            np.zeros((40, 3), complex),
            np.array(["a"] * 40),
            np.zeros(0),
            np.array(3.0),
            np.zeros((40, 3), "M8[s]"),
            np.zeros((3, 40)),
            np.array([{}] * 40, dtype=object),
            np.zeros((40, 3, 1)),
            np.zeros(40, "V8"),
        )
        arrays[pick(rng, list(arrays))] = pick(rng, odd)
    buffer = io.BytesIO()
    (np.savez if way % 2 else np.savez_compressed)(buffer, **arrays)
    raw = buffer.getvalue()
    if way in (5, 6):
        return "bytes", spoiled_bytes(rng, raw)
    if way in (7, 8):
        return "header", _odd_header(rng)
    if way == 9:
        return "bomb", _zip_bomb(rng)
    return "samples", raw


def _odd_header(rng: Rng) -> bytes:
    """`.npy` members whose headers claim other shapes and types than there are."""
    claims = (
        "(1000000000000,)",
        "(0,)",
        "(-1,)",
        "(40,3,10**9)",
        "(4,)*99999",
        "()",
        "(2**62, 4)",
        "('a',)",
        "__import__('os')",
        "(" * 500,
        "(40, 3)",
        "(1.5,)",
        "(True,)",
    )
    kinds = (
        "'<f8'",
        "'O'",
        "'|V0'",
        "'<U0'",
        "'<U999999999'",
        "[('a','<f8')]",
        "'x'",
        "'<f8'",
        "'>i4'",
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("t", "q", "joint_names"):
            text = f"{{'descr': {pick(rng, kinds)}, 'fortran_order': False, "
            text += f"'shape': {pick(rng, claims)}, }}"
            header = text.encode() + b"\n"
            version, width = pick(
                rng, ((b"\x01\x00", 2), (b"\x02\x00", 4), (b"\x03\x00", 4), (b"\x09\x00", 4))
            )
            length = len(header) if rng.random() < 0.9 else 2**15
            archive.writestr(
                f"{name}.npy",
                b"\x93NUMPY" + version + length.to_bytes(width, "little") + header + b"\0" * 400,
            )
    return buffer.getvalue()


def _zip_bomb(rng: Rng) -> bytes:
    """Zeros: a thousand times as large in memory as on disk."""
    rows = int(pick(rng, (10**4, 10**6, 5 * 10**6)))
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer, t=np.arange(40.0), q=np.zeros((rows, 3)), joint_names=np.array(JOINTS)
    )
    return buffer.getvalue()
