"""Identified parameters as HDF5, field by field, the fit in the group `/fit`.

A fit file stands on its own: it holds the resolved problem as YAML text, and of every effect its
kind, joints, shape and runs, from which the model is built again.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from excite_cli.atomic import write_atomically
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.uncertain_inertias import FitKnowledge
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import FileError
from excite_cli.identification.fit import Fit
from excite_cli.identification.identify import Identification
from excite_cli.identification.stored_model import StoredFit
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.store import checked
from excite_cli.store.codec import as_json, read_record, write_record
from excite_cli.store.own_file import PROGRAM, OwnFile, is_marked, opened, versions

SCHEMA = 2  # since 0.3, which says held-out for sealed
KIND = "fit"
OWN = OwnFile(
    "a fit", "Such files are written by `excite identify`.", SCHEMA, ("kind", KIND), oldest=2
)
_ARRAYS = ("values", "std", "relative_std", "identifiable", "essential")


@dataclass(frozen=True)
class _StoredEffect:
    """An effect as the file has it: joints by their place."""

    kind: str
    joints: tuple[int, ...]
    shape: dict[str, float]
    runs: tuple[str, ...]
    covariate: str = ""


def write_fit(
    path: Path,
    found: Identification,
    config: str,
    config_folder: str,
    fingerprint: str,
    sources: tuple[str, ...] = (),
) -> None:
    """Write a fit with what belongs to it; the file appears whole or not at all.

    `config` is the resolved problem (YAML), its paths relative to `config_folder`; `sources` name
    the files that the data came from.
    """
    stored = StoredFit(
        config, config_folder, fingerprint, found.fit, found.held_out_run, found.error,
        found.training_error, found.findings, sources, found.noise_floor,
        found.hausman.sentence(), found.processing.as_data(), versions(), found.torque_units,
        found.traces, found.recorded,
    )  # fmt: skip
    write_atomically(path, lambda temporary: _write(temporary, stored))


def _write(path: Path, stored: StoredFit) -> None:
    with new_hdf5(path) as file:
        file.attrs.update({"program": PROGRAM, "kind": KIND, "schema": SCHEMA})
        file.attrs["units"] = "rad, s, N·m, kg, m"
        write_record(file, stored, without={"fit"})
        group = file.create_group("fit")
        write_record(group, stored.fit, without={"effects"})
        group["records/effects"] = as_json(
            [
                _StoredEffect(each.kind, each.joints, dict(each.shape), each.runs, each.covariate)
                for each in stored.fit.effects
            ]
        )


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
        return _read(file, path)


def is_fit(path: Path) -> bool:
    """Whether `path` is a file that `write_fit` wrote."""
    return is_marked(path, OWN)


def _read(file: Any, path: Path) -> StoredFit:
    group = file["fit"]
    joints = checked.texts(group["joint_names"][()], "joint_names")
    effects = tuple(
        _effect(each, str(file.filename), len(joints))
        for each in checked.record(group["records/effects"][()], tuple[_StoredEffect, ...])
    )
    fit = read_record(group, Fit, {"effects": effects})
    stored = read_record(file, StoredFit, {"fit": fit}, n=len(joints))
    checked.stored_spec(stored.config, str(path))
    checked.names(joints, "joint_names")
    size = len(fit.names) - sum(len(each.parameters) for each in effects)
    consistent = fit.consistent
    if size != fit.rank or (consistent and len(consistent.effects) != len(fit.names) - size):
        raise ValueError("its parameters are not those of its effects")
    if len(fit.links) not in (0, len(fit.phi) // 10):
        raise ValueError("'links' are not those of its bodies")
    checked.require_joints(joints, (stored.error, stored.training_error), stored.noise_floor)
    if len(stored.torque_units) != len(joints):
        raise ValueError("'torque_units' do not fit its joints")
    return stored


def _effect(stored: _StoredEffect, path: str, joints: int) -> Effect:
    """The effect, if its kind has such a shape and the robot such joints."""
    kind = kind_named(stored.kind, path)
    known = {parameter.name for parameter in kind.shapes}
    if set(stored.shape) != known or not all(0 <= joint < joints for joint in stored.joints):
        raise ValueError(f"the effect '{stored.kind}' has no such shape, or acts on no such joint")
    if not stored.joints and kind.scope != "robot":
        raise ValueError(f"the effect '{stored.kind}' acts on no joint")
    if kind.follows_covariate != bool(stored.covariate):
        raise ValueError(f"the effect '{stored.kind}' follows no column, or lacks the one it does")
    return kind(stored.joints, stored.shape, stored.runs, stored.covariate)


# What a fit file knows of the inertias: the ellipsoid of `uncertainty.fit`.


def fit_knowledge(spec: Spec, folder: Path) -> FitKnowledge | None:
    """Values and covariance of the fit that `uncertainty.fit` names; None where it names none.

    Its path starts from `folder`.

    Raises
    ------
    FileError
        It cannot be read, or was made with another payload.
    """
    if spec.uncertainty is None or spec.uncertainty.fit is None:
        return None
    path = folder / spec.uncertainty.fit
    if not path.is_file():
        raise FileError(
            f"uncertainty.fit: there is no file {path}. Write one with `excite identify`, or leave "
            "it out."
        )
    stored = read_fit(path)
    fit = stored.fit
    carried = parse_spec(stored.config, f"the config stored in {path}").robot.payload
    if carried != spec.robot.payload:
        raise FileError(
            f"uncertainty.fit: {path} was made with another robot.payload, so its inertias are "
            "others. Identify with the payload of this config, or give the same one."
        )
    return FitKnowledge(
        values=fit.base_values,
        covariance=fit.covariance[: fit.rank, : fit.rank],
        names=fit.names[: fit.rank],
        fingerprint=stored.fingerprint,
        source=spec.uncertainty.fit,
    )
