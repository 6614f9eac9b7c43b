"""The program's own HDF5 files: results, fits and diagnoses, spoiled in records, arrays and bytes.

The entries are those of `report`, `check`, `export`, `--prior`, `--after` and `uncertainty.fit`.
"""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from benchmarks.trust.fuzz_hdf5 import _WAYS
from benchmarks.trust.fuzz_mutations import (
    Rng,
    odd_number,
    odd_text,
    odd_value,
    pick,
    spoiled_bytes,
    spoiled_tree,
)
from benchmarks.trust.fuzz_trial import Fuzzer
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
from excite_cli.excitation.result import Result
from excite_cli.store.result_file import read_samples, write_result

_CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
_KINDS = ("result", "fit", "diagnosis")


class ResultFuzzer(Fuzzer):
    """Files of results."""

    name = "results"

    def prepare(self, bases: Path) -> None:
        """A short loop on the small arm: plan, simulate, identify, diagnose."""
        if (bases / "diagnosis.h5").is_file():
            return
        problem = load_problem(_CONFIG, ["optimizer.max_iterations=4", "diagnosis.rounds=2"])
        result = plan(problem)
        write_result(bases / "result.h5", result, problem)
        data = simulate(problem, result, ["coulomb_friction@elbow=3"]).dataset
        save_fit(bases / "fit.h5", problem, identify(problem, data))
        diagnose(problem, data, output=bases / "diagnosis.h5")

    def open(self, bases: Path) -> None:
        """The files' bytes."""
        self._data = {kind: (bases / f"{kind}.h5").read_bytes() for kind in _KINDS}

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled file."""
        kind = pick(rng, _KINDS)
        path = folder / "stored.h5"
        way = int(rng.integers(10))
        if way < 4:
            path.write_bytes(spoiled_bytes(rng, self._data[kind], int(pick(rng, (1, 2, 5, 20)))))
            return path, f"bytes of {kind}"
        path.write_bytes(self._data[kind])
        made = "nothing"
        with h5py.File(path, "a") as file:
            for _ in range(int(rng.integers(1, 3))):
                made = _spoil(rng, path, file)
        return path, f"{made} of {kind}"

    def enter(self, path: Path) -> None:
        """As a report reads it; motions are sampled too."""
        content = read_files([path])[0].content
        if isinstance(content, Result):
            read_samples(path)
            for motion in motions_of(content, name=str(path)):
                motion.trajectory.states(np.linspace(0, 1, 5), motion.coefficients)


def _spoil(rng: Rng, path: Path, file: Any) -> str:
    items: list[Any] = [file]
    file.visititems(lambda _, item: items.append(item))
    item = pick(rng, items)
    try:
        if item.attrs and rng.random() < 0.5:
            _attribute(rng, item)
            return "attribute"
        if isinstance(item, h5py.Group):
            way = pick(rng, list(_WAYS))
            name = pick(rng, list(item) or ["x"])
            if way != "names" and name in item:
                del item[name]
            _WAYS[way](rng, path, item, name)
            return way
        _dataset(rng, path, item)
        return "array"
    except (ValueError, TypeError, OSError, RuntimeError, OverflowError, KeyError, MemoryError):
        return "nothing"  # h5py itself refuses to write it


def _attribute(rng: Rng, item: Any) -> None:
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


def _dataset(rng: Rng, path: Path, item: Any) -> None:
    if not isinstance(item, h5py.Dataset) or item.nbytes > 10**8:
        return  # made so by an earlier change
    parent, name, value = item.parent, item.name.rsplit("/", 1)[1], item[()]
    if isinstance(value, bytes) and value[:1] in b"{[" and rng.random() < 0.8:
        tree = spoiled_tree(rng, json.loads(value))
        del parent[name]
        parent[name] = json.dumps(tree)
        return
    if (
        isinstance(value, np.ndarray)
        and value.size
        and value.dtype.kind == "f"
        and rng.random() < 0.6
    ):
        flat = np.array(value, dtype=float).ravel()
        flat[int(rng.integers(flat.size))] = float(odd_number(rng))
        value = flat.reshape(value.shape)
        if rng.random() < 0.5:
            value = pick(rng, (value[:-1], value.T, value[None], value.ravel(), value * np.nan))
        del parent[name]
        parent[name] = value
        return
    del parent[name]
    _WAYS[pick(rng, list(_WAYS))](rng, path, parent, name)
