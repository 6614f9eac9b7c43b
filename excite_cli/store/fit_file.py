"""Identified parameters as HDF5: `/parameters`, `/bodies`, errors and findings as attributes.

A fit file stands on its own: it holds the resolved problem as YAML text, and of every effect its
kind, joints, shape and runs, from which the model is built again.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.atomic import write_atomically
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.consistent import ConsistentParameters
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.identify import Identification
from excite_cli.identification.stored_fit import StoredFit
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.hdf5_file import new_hdf5
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.store.own_file import PROGRAM, OwnFile, opened
from excite_cli.store.trace_groups import read_torque_traces, write_torque_traces
from excite_cli.store.versions import versions

SCHEMA = 1
KIND = "fit"
OWN = OwnFile("a fit", "Such files are written by `excite identify`.", SCHEMA, ("kind", KIND))
_ARRAYS = ("values", "std", "relative_std", "identifiable", "essential")


def write_fit(
    path: Path,
    found: Identification,
    config: str,
    config_folder: str,
    fingerprint: str,
    sources: tuple[str, ...] = (),
) -> None:
    """Write `found` with the resolved problem (YAML text), its folder and the robot's hash.

    Raises
    ------
    FileError
        The file cannot be written.
    """
    attributes = {
        "program": PROGRAM,
        "kind": KIND,
        "schema": SCHEMA,
        "versions": json.dumps(versions()),
        "config": config,
        "config_folder": config_folder,
        "robot_hash": fingerprint,
        "joint_names": list(found.fit.joint_names),
        "sources": list(sources),
        "sealed_run": found.sealed_run,
        "error": json.dumps(found.error.as_data()),
        "training_error": json.dumps(found.training_error.as_data()),
        "processing": json.dumps(found.processing.as_data()),
        "noise_floor": json.dumps(found.noise_floor),
        "closed_loop_bias": found.hausman.sentence(),
        "findings": json.dumps([asdict(finding) for finding in found.findings]),
        "torque_units": json.dumps(found.torque_units),
        "units": "rad, s, N·m, kg, m",
    }
    write_atomically(path, lambda temporary: _write(temporary, found, attributes))


def _write(path: Path, found: Identification, attributes: dict[str, Any]) -> None:
    fit = found.fit
    with new_hdf5(path) as file:
        file.attrs.update(attributes)
        write_torque_traces(file.create_group("traces"), found.traces)
        group = file.create_group("parameters")
        for name in _ARRAYS:
            group[name] = getattr(fit, name)
        group["covariance"] = fit.covariance
        for name in ("names", "units", "words"):
            group[name] = np.array(list(getattr(fit, name)), dtype=h5py.string_dtype())
        group.attrs.update(
            {
                "rank": fit.rank,
                "method": fit.method,
                "inertias": fit.inertias,
                "count": fit.count,
                "samples": fit.samples,
                "effects": json.dumps([_effect_data(effect) for effect in fit.effects]),
            }
        )
        file["noise"] = fit.noise
        file["bodies/phi"] = fit.phi
        if fit.consistent is not None:
            consistent = file.create_group("bodies/consistent")
            for name in ("phi", "effects", "eigenvalues"):
                consistent[name] = getattr(fit.consistent, name)
            for name in ("cost", "status", "solved"):
                consistent.attrs[name] = getattr(fit.consistent, name)


def _effect_data(effect: Effect) -> dict[str, Any]:
    return {
        "kind": effect.kind,
        "joints": list(effect.joints),
        "shape": dict(effect.shape),
        "runs": list(effect.runs),
    }


def read_fit(path: Path) -> StoredFit:
    """Read a fit file.

    Raises
    ------
    FileError
        The file is missing, unreadable, not a fit of this program, damaged, or of a newer schema.
    ConfigError
        An effect of it is not in the catalogue.
    """
    with opened(path, OWN) as file:
        return _read(file)


def is_fit(path: Path) -> bool:
    """Whether `path` is a file that `write_fit` wrote."""
    if not (path.is_file() and h5py.is_hdf5(path)):
        return False
    try:
        with limited_memory(path), h5py.File(path, "r") as file:
            return str(file.attrs.get("kind", "")) == KIND
    except Exception:  # damaged, in whatever way: whoever reads it says so
        return False


def _read(file: Any) -> StoredFit:
    attributes = file.attrs
    return StoredFit(
        config=str(attributes["config"]),
        config_folder=str(attributes["config_folder"]),
        fingerprint=str(attributes["robot_hash"]),
        fit=_read_fit(file),
        sealed_run=str(attributes["sealed_run"]),
        error=_errors(attributes["error"]),
        training_error=_errors(attributes["training_error"]),
        findings=tuple(
            Finding(**{**item, "joints": tuple(item["joints"])})
            for item in json.loads(attributes["findings"])
        ),
        sources=tuple(str(name) for name in attributes["sources"]),
        noise_floor=_floor(attributes.get("noise_floor", "null")),
        closed_loop_bias=str(attributes.get("closed_loop_bias", "")),
        processing=json.loads(attributes.get("processing", "{}")),
        versions=json.loads(attributes.get("versions", "{}")),
        torque_units=tuple(json.loads(attributes.get("torque_units", "[]"))),
        traces=read_torque_traces(file["traces"]) if "traces" in file else (),
    )


def _floor(text: str) -> dict[str, float] | None:
    data = json.loads(text)
    return None if data is None else {str(name): float(value) for name, value in data.items()}


def _errors(text: str) -> Errors:
    data = json.loads(text)
    return Errors(**{**data, "interval": tuple(data["interval"])})


def _read_fit(file: Any) -> Fit:
    group = file["parameters"]
    settings = group.attrs
    texts: dict[str, Any] = {
        name: tuple(text.decode() for text in group[name][()])
        for name in ("names", "units", "words")
    }
    arrays: dict[str, Any] = {name: np.asarray(group[name]) for name in (*_ARRAYS, "covariance")}
    size = len(texts["names"])
    if any(len(array) != size for array in arrays.values()) or np.isnan(arrays["values"]).any():
        raise ValueError("its arrays of parameters do not fit together")
    effects = tuple(
        kind_named(item["kind"], str(file.filename))(
            tuple(item["joints"]), dict(item["shape"]), tuple(item["runs"])
        )
        for item in json.loads(settings["effects"])
    )
    return Fit(
        method=str(settings["method"]),
        inertias=str(settings["inertias"]),
        joint_names=tuple(str(name) for name in file.attrs["joint_names"]),
        effects=effects,
        rank=int(settings["rank"]),
        noise=np.asarray(file["noise"]),
        phi=np.asarray(file["bodies/phi"]),
        count=int(settings["count"]),
        samples=float(settings["samples"]),
        consistent=_consistent(file["bodies"].get("consistent")),
        **texts,
        **arrays,
    )


def _consistent(group: Any) -> ConsistentParameters | None:
    if group is None:
        return None
    return ConsistentParameters(
        phi=np.asarray(group["phi"]),
        effects=np.asarray(group["effects"]),
        eigenvalues=np.asarray(group["eigenvalues"]),
        cost=float(group.attrs["cost"]),
        status=str(group.attrs["status"]),
        solved=bool(group.attrs["solved"]),
    )
