"""Results as HDF5: `/motions/<i>`, `/tables`, `/stack`, `/base_parameters`, `/collision_pairs`.

The file is written anew and put in place after every finished motion, so that it is whole at any
time. Reading trusts nothing: a foreign or damaged file gives one message.
"""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.arrays import Array
from excite_cli.atomic import write_atomically
from excite_cli.excitation.motion import Doubt, Motion, digest_of_array
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Status
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.proof.certificate import Worst
from excite_cli.store import checked
from excite_cli.store.own_file import PROGRAM, OwnFile, opened
from excite_cli.trajectory.catalogue import build_trajectory

# Whether a motion in a file is still the one that was proved, by the digest that it was given.
#
# The digest in a file is that of the motion (`excitation/motion.py`) and of its samples in
# the file: what a script reads there is part of what must not have changed.


def digest_with_samples(digest: str, samples: Sequence[Array]) -> str:
    """What a file holds of a motion of this `digest`, with its samples t (T,), q, v, a (T, n)."""
    parts = (digest, *map(digest_of_array, samples))
    return hashlib.sha256("|".join(parts).encode()).hexdigest()


def as_found(motion: Motion, digest: str, samples: Sequence[Array], stored: str) -> Motion:
    """The motion of a file, doubted where it is not what it was.

    `digest` is that of what the file holds now, `stored` what the file says; empty: nothing.
    """
    if not stored:
        return motion.doubted(Doubt.EARLIER)
    if stored == digest_with_samples(digest, samples):
        return replace(motion, digest=digest)
    return replace(motion.doubted(Doubt.CHANGED), digest=stored)


Matrix = Array

SCHEMA = 1
OWN = OwnFile(
    "a result",
    "Result files are written by `excite optimize` and `excite compare-random`.",
    SCHEMA,
)
_OPTIONAL = ("dense_condition_number", "predicted_deviation")
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
            if chosen.predicted_deviation is not None:
                group.attrs["predicted_deviation"] = chosen.predicted_deviation
        file["tables/condition_number"] = _table(result.motions)
        file["tables/random"] = _table(result.random)
        file["stack/R"] = result.stack.factor
        if result.stack.plain is not None:
            file["stack/R_plain"] = result.stack.plain
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


def _write_states(group: Any, coefficients: Any, problem: Problem) -> list[Matrix]:
    """Write the motion and its samples t (T,), q, v, a (T, n), which are returned."""
    times = problem.constraint_basis.times
    if times[-1] < problem.trajectory.duration:
        times = np.append(times, problem.trajectory.duration)
    q, v, a = problem.trajectory.basis(times).states(coefficients)
    arrays = {"t": times, "q": q, "v": v, "a": a}
    for name, array in {**arrays, "coefficients": coefficients}.items():
        group[name] = array
    return list(arrays.values())


def _write_motion(group: Any, motion: Motion, problem: Problem) -> None:
    samples = _write_states(group, motion.coefficients, problem)
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
    for name in _OPTIONAL:
        if getattr(motion, name) is not None:
            group.attrs[name] = getattr(motion, name)
    if motion.digest:
        group.attrs["digest"] = digest_with_samples(motion.digest, samples)


def read_result(path: Path) -> Result:
    """Read a result file; of motions that changed since they were proved, nothing counts as proved.

    Raises
    ------
    FileError
        The file is missing, unreadable, not one of this program, damaged, or of a newer schema.
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
        joints = len(checked.names(file.attrs["joint_names"], "attribute 'joint_names'"))
        return {int(index): _samples(group, joints) for index, group in file["motions"].items()}


def _samples(group: Any, joints: int) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    t = checked.array(group["t"], (None,))
    q, v, a = (checked.array(group[name], (len(t), joints)) for name in "qva")
    return t, q, v, a


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
    config = checked.text(attributes, "config")
    joint_names = checked.names(attributes["joint_names"], "joint_names")
    trajectory = build_trajectory(checked.stored_spec(config, str(path)).trajectory)
    shape = (trajectory.n_coefficients, len(joint_names))
    base = file["base_parameters"]
    selection = checked.indices(base["selection"])
    words = checked.texts(base["words"][()], "base_parameters/words")
    columns = len(words)
    if columns < len(selection):
        raise ValueError("its base parameters do not fit together")
    drawn = checked.record(json.dumps(attributes["random_candidates"].tolist()), tuple[int, int])
    found = Result(
        config=config,
        config_folder=checked.text(attributes, "config_folder"),
        fingerprint=checked.text(attributes, "robot_hash"),
        seed=checked.count(attributes, "seed"),
        joint_names=joint_names,
        base_selection=selection,
        base_words=words,
        row_weights=checked.array(base["row_weights"], (None,)),
        column_scales=checked.array(base["column_scales"], (columns,)),
        motions=tuple(
            _read_motion(file[f"motions/{index}"], index, shape)
            for index in range(1, len(file.get("motions", {})) + 1)
        ),
        stack=_read_stack(file["stack/R"], file["stack"], columns, file.get("stack/R_plain")),
        prior_stack=_read_stack(file["stack/R_0"], file["stack/R_0"], columns),
        random=tuple(
            RandomMotion(
                index,
                checked.array(file[f"random/{index}/coefficients"], shape),
                checked.condition(file[f"random/{index}"].attrs, "condition_number"),
                checked.condition(file[f"random/{index}"].attrs, "stacked_condition_number"),
                _optional(file[f"random/{index}"].attrs, "predicted_deviation", checked.number),
            )
            for index in sorted(int(name) for name in file.get("random", {}))
        ),
        random_candidates=drawn,
        priors=checked.texts(attributes["priors"], "priors"),
        versions=checked.record(attributes["versions"], dict[str, str]),
        checked_pairs=checked.texts(file["collision_pairs/checked"][()], "collision_pairs/checked"),
        dropped_pairs=checked.texts(file["collision_pairs/dropped"][()], "collision_pairs/dropped"),
    )
    motions = (_as_found(file[f"motions/{each.index}"], each, found) for each in found.motions)
    return replace(found, motions=tuple(motions))


def _as_found(group: Any, motion: Motion, result: Result) -> Motion:
    samples = _samples(group, len(result.joint_names))
    stored = checked.text(group.attrs, "digest", "")
    return as_found(motion, result.digest_of(motion), samples, stored)


def _optional(attributes: Any, name: str, read: Callable[[Any, str], float]) -> float | None:
    return read(attributes, name) if name in attributes else None


def _read_stack(dataset: Any, counted: Any, columns: int, plain: Any = None) -> Stack:
    """The factor (columns, columns) and the rows it stands for, an attribute of `counted`."""
    factor = checked.array(dataset, (columns, columns))
    below = None if plain is None else checked.array(plain, (None, None))
    return Stack(factor, checked.count(counted.attrs, "rows"), below)


def _read_motion(group: Any, index: int, shape: tuple[int, int]) -> Motion:
    attributes = group.attrs
    return Motion(
        index=index,
        coefficients=checked.array(group["coefficients"], shape),
        condition_number=checked.condition(attributes, "condition_number"),
        stacked_condition_number=checked.condition(attributes, "stacked_condition_number"),
        improved=checked.flag(attributes, "improved"),
        note=checked.text(attributes, "note"),
        status=Status(checked.text(attributes, "status")),
        seconds=checked.number(attributes, "seconds"),
        iterations=checked.count(attributes, "iterations"),
        evaluations=checked.count(attributes, "evaluations"),
        margins=checked.record(attributes["margins"], dict[str, Worst]),
        certified=checked.record(attributes.get("certified", "{}"), dict[str, bool]),
        dense_condition_number=_optional(attributes, "dense_condition_number", checked.condition),
        predicted_deviation=_optional(attributes, "predicted_deviation", checked.number),
    )
