"""Results as HDF5: `/motions/<i>`, `/tables`, `/stack`, `/base_parameters`, `/collision_pairs`.

The file is written anew and put in place after every finished motion, so that it is whole at any
time. Reading trusts nothing: a foreign or damaged file gives one message.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from excite_cli.atomic import write_atomically
from excite_cli.errors import FileError
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Status
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.measurement.hdf5_file import new_hdf5
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.proof.worst_margin import Worst
from excite_cli.store.own_file import PROGRAM, OwnFile, opened

Matrix = NDArray[np.float64]

SCHEMA = 1
OWN = OwnFile(
    "a result",
    "Result files are written by `excite optimize` and `excite compare-random`.",
    SCHEMA,
)
_TABLE = [("motion", "i8"), ("own", "f8"), ("stacked", "f8")]


def write_result(path: Path, result: Result, problem: Problem) -> None:
    """Write `result`; trajectories are sampled on the constraint grid of `problem`."""
    write_atomically(path, lambda temporary: _write(temporary, result, problem))


def _write(path: Path, result: Result, problem: Problem) -> None:
    with new_hdf5(path) as file:
        file.attrs.update(
            {
                "program": PROGRAM,
                "schema": SCHEMA,
                "versions": json.dumps(result.versions),
                "seed": result.seed,
                "config": result.config,
                "config_folder": result.config_folder,
                "robot_hash": result.fingerprint,
                "joint_names": list(result.joint_names),
                "priors": list(result.priors),
                "random_candidates": list(result.random_candidates),
                "units": "rad, s, N·m, kg, m",
            }
        )
        for motion in result.motions:
            _write_motion(file.create_group(f"motions/{motion.index}"), motion, problem)
        for chosen in result.random:
            group = file.create_group(f"random/{chosen.index}")
            _write_states(group, chosen.coefficients, problem)
            group.attrs["condition_number"] = chosen.condition_number
            group.attrs["stacked_condition_number"] = chosen.stacked_condition_number
        file["tables/condition_number"] = _table(result.motions)
        file["tables/random"] = _table(result.random)
        file["stack/R"] = result.stack.factor
        file["stack"].attrs["rows"] = result.stack.rows
        file["stack/R_0"] = result.prior_stack.factor
        file["stack/R_0"].attrs["rows"] = result.prior_stack.rows
        group = file.create_group("base_parameters")
        group["selection"] = result.base_selection
        group["words"] = list(result.base_words)
        group["row_weights"] = result.row_weights
        group["column_scales"] = result.column_scales
        file["collision_pairs/checked"] = _texts(result.checked_pairs)
        file["collision_pairs/dropped"] = _texts(result.dropped_pairs)


def _texts(words: tuple[str, ...]) -> Any:
    return np.array(list(words), dtype=h5py.string_dtype())


def _table(motions: tuple[Motion, ...] | tuple[RandomMotion, ...]) -> Any:
    rows = [(m.index, m.condition_number, m.stacked_condition_number) for m in motions]
    return np.array(rows, dtype=_TABLE)


def _write_states(group: Any, coefficients: Any, problem: Problem) -> None:
    times = problem.constraint_basis.times
    if times[-1] < problem.trajectory.duration:
        times = np.append(times, problem.trajectory.duration)
    q, v, a = problem.trajectory.basis(times).states(coefficients)
    arrays = {"t": times, "q": q, "v": v, "a": a}
    for name, array in {**arrays, "coefficients": coefficients}.items():
        group[name] = array


def _write_motion(group: Any, motion: Motion, problem: Problem) -> None:
    _write_states(group, motion.coefficients, problem)
    group.attrs.update(
        {
            "condition_number": motion.condition_number,
            "stacked_condition_number": motion.stacked_condition_number,
            "improved": motion.improved,
            "note": motion.note,
            "status": str(motion.status),
            "seconds": motion.seconds,
            "iterations": motion.iterations,
            "evaluations": motion.evaluations,
            "certified": json.dumps(motion.certified),
            "margins": json.dumps(
                {
                    name: asdict(worst) for name, worst in motion.margins.items()
                }
            ),
        }
    )  # fmt: skip


def read_result(path: Path) -> Result:
    """Read a result file.

    Raises
    ------
    FileError
        The file is missing, unreadable, not ours, damaged, or of a newer schema.
    """
    with opened(path, OWN) as file:
        return _read(file, path)


def read_samples(path: Path) -> dict[int, tuple[Matrix, Matrix, Matrix, Matrix]]:
    """t (T,), q, v, a (T, n) of every motion as they stand in the file.

    Raises
    ------
    FileError
        As `read_result`.
    """
    with opened(path, OWN) as file:
        return {
            int(index): (
                np.asarray(group["t"], dtype=float),
                _finite_matrix(group["q"]),
                _finite_matrix(group["v"]),
                _finite_matrix(group["a"]),
            )
            for index, group in file["motions"].items()
        }


def is_result(path: Path) -> bool:
    """Whether `path` is an HDF5 file of motions that this program planned (or a damaged one)."""
    if not (path.is_file() and h5py.is_hdf5(path)):
        return False
    try:
        with limited_memory(path), h5py.File(path, "r") as file:
            return "base_parameters" in file or "stack" in file
    except Exception:  # damaged, in whatever way: whoever reads it says so
        return True


def _read(file: Any, path: Path) -> Result:
    attributes = file.attrs
    content = str(attributes.get("content", "motions"))
    if content != "motions":
        raise FileError(
            f"{path} holds a {content}, not motions. Motions are written by `excite optimize` and "
            "`excite compare-random`."
        )
    base = file["base_parameters"]
    return Result(
        config=str(attributes["config"]),
        config_folder=str(attributes["config_folder"]),
        fingerprint=str(attributes["robot_hash"]),
        seed=int(attributes["seed"]),
        joint_names=tuple(str(name) for name in attributes["joint_names"]),
        base_selection=np.asarray(base["selection"]),
        base_words=tuple(text.decode() for text in base["words"][()]),
        row_weights=np.asarray(base["row_weights"]),
        column_scales=np.asarray(base["column_scales"]),
        motions=tuple(
            _read_motion(file[f"motions/{index}"], index)
            for index in range(1, len(file.get("motions", {})) + 1)
        ),
        stack=_read_stack(file["stack/R"], int(file["stack"].attrs["rows"])),
        prior_stack=_read_stack(file["stack/R_0"], int(file["stack/R_0"].attrs["rows"])),
        random=tuple(
            RandomMotion(
                index,
                _finite_matrix(file[f"random/{index}/coefficients"]),
                float(file[f"random/{index}"].attrs["condition_number"]),
                float(file[f"random/{index}"].attrs["stacked_condition_number"]),
            )
            for index in sorted(int(name) for name in file.get("random", {}))
        ),
        random_candidates=(
            int(attributes["random_candidates"][0]),
            int(attributes["random_candidates"][1]),
        ),
        priors=tuple(str(name) for name in attributes["priors"]),
        versions=json.loads(attributes["versions"]),
        checked_pairs=tuple(text.decode() for text in file["collision_pairs/checked"][()]),
        dropped_pairs=tuple(text.decode() for text in file["collision_pairs/dropped"][()]),
    )


def _read_stack(dataset: Any, rows: int) -> Stack:
    factor = _finite_matrix(dataset)
    if factor.shape[0] != factor.shape[1]:
        raise ValueError(f"{dataset.name} is not square")
    return Stack(factor, rows)


def _finite_matrix(dataset: Any) -> NDArray[np.float64]:
    matrix = np.asarray(dataset, dtype=float)
    if matrix.ndim != 2 or not np.isfinite(matrix).all():
        raise ValueError(f"{dataset.name} is not a matrix of finite numbers")
    return matrix


def _read_motion(group: Any, index: int) -> Motion:
    attributes = group.attrs
    margins = json.loads(attributes["margins"])
    return Motion(
        index=index,
        coefficients=_finite_matrix(group["coefficients"]),
        condition_number=float(attributes["condition_number"]),
        stacked_condition_number=float(attributes["stacked_condition_number"]),
        improved=bool(attributes["improved"]),
        note=str(attributes["note"]),
        status=Status(str(attributes["status"])),
        seconds=float(attributes["seconds"]),
        iterations=int(attributes["iterations"]),
        evaluations=int(attributes["evaluations"]),
        margins={name: Worst(**worst) for name, worst in margins.items()},
        certified=json.loads(attributes.get("certified", "{}")),
    )
