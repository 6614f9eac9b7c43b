"""Identified parameters as HDF5: `/parameters`, `/bodies`, errors and findings as attributes.

A fit file stands on its own: it holds the resolved problem as YAML text, and of every effect its
kind, joints, shape and runs, from which the model is built again.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.atomic import write_atomically
from excite_cli.config.load import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.uncertain_inertias import FitKnowledge
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import FileError
from excite_cli.identification.consistent import ConsistentParameters
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.identify import Identification
from excite_cli.identification.link_changes import LinkChange
from excite_cli.identification.stored_model import StoredFit
from excite_cli.measurement.campaign_clock import Recorded
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.store import checked
from excite_cli.store.own_file import PROGRAM, OwnFile, is_marked, opened, versions
from excite_cli.store.trace_groups import read_torque_traces, require_joints, write_torque_traces

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
    covariate: str = ""  # files of earlier versions have none


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
        "held_out_run": found.held_out_run,
        "error": json.dumps(found.error.as_data()),
        "training_error": json.dumps(found.training_error.as_data()),
        "processing": json.dumps(found.processing.as_data()),
        "noise_floor": json.dumps(found.noise_floor),
        "closed_loop_bias": found.hausman.sentence(),
        "findings": json.dumps([asdict(finding) for finding in found.findings]),
        "torque_units": json.dumps(found.torque_units),
        "recorded": json.dumps(asdict(found.recorded)),
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
                "kept": list(fit.kept),
                "effects": json.dumps([_effect_data(effect) for effect in fit.effects]),
            }
        )
        file["noise"] = fit.noise
        file["bodies/phi"] = fit.phi
        if fit.consistent is not None:
            consistent = file.create_group("bodies/consistent")
            for name in ("phi", "effects", "eigenvalues"):
                consistent[name] = getattr(fit.consistent, name)
            for name in ("cost", "status", "solved", "spread"):
                consistent.attrs[name] = getattr(fit.consistent, name)
            # As a dataset: attributes end at 64 KB, which a humanoid comes near.
            consistent["links"] = json.dumps([asdict(link) for link in fit.links])


def _effect_data(effect: Effect) -> dict[str, Any]:
    return {
        "kind": effect.kind,
        "joints": list(effect.joints),
        "shape": dict(effect.shape),
        "runs": list(effect.runs),
        "covariate": effect.covariate,
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
        return _read(file, path)


def is_fit(path: Path) -> bool:
    """Whether `path` is a file that `write_fit` wrote."""
    return is_marked(path, OWN)


def _read(file: Any, path: Path) -> StoredFit:
    attributes = file.attrs
    config = checked.text(attributes, "config")
    checked.stored_spec(config, str(path))
    joints = checked.names(attributes["joint_names"], "joint_names")
    stored = StoredFit(
        config=config,
        config_folder=checked.text(attributes, "config_folder"),
        fingerprint=checked.text(attributes, "robot_hash"),
        fit=_read_fit(file, joints),
        held_out_run=checked.text(attributes, "held_out_run"),
        error=checked.record(attributes["error"], Errors),
        training_error=checked.record(attributes["training_error"], Errors),
        findings=checked.record(attributes["findings"], tuple[Finding, ...]),
        sources=checked.texts(attributes["sources"], "sources"),
        noise_floor=checked.record(attributes.get("noise_floor", "null"), dict[str, float] | None),
        closed_loop_bias=checked.text(attributes, "closed_loop_bias", ""),
        processing=checked.record(attributes.get("processing", "{}"), dict[str, Any]),
        versions=checked.record(attributes.get("versions", "{}"), dict[str, str]),
        torque_units=checked.record(attributes.get("torque_units", "[]"), tuple[str, ...]),
        traces=read_torque_traces(file["traces"], len(joints)) if "traces" in file else (),
        recorded=checked.record(attributes.get("recorded", "{}"), Recorded),
    )
    require_joints(joints, (stored.error, stored.training_error), stored.noise_floor)
    if len(stored.torque_units) not in (0, len(joints)):
        raise ValueError("'torque_units' do not fit its joints")
    return stored


def _read_fit(file: Any, joints: tuple[str, ...]) -> Fit:
    group = file["parameters"]
    settings, rank = group.attrs, checked.count(group.attrs, "rank")
    names = checked.texts(group["names"][()], "parameters/names")
    size = len(names)
    effects = tuple(
        _effect(item, str(file.filename), len(joints))
        for item in checked.record(settings["effects"], tuple[_StoredEffect, ...])
    )
    if rank + sum(len(effect.parameters) for effect in effects) != size:
        raise ValueError("its parameters are not those of its effects")
    texts: dict[str, Any] = {
        name: checked.texts(group[name][()], f"parameters/{name}") for name in ("units", "words")
    }
    arrays: dict[str, Any] = {
        name: checked.flags(group[name], (size,)) for name in ("identifiable", "essential")
    }
    # What the data do not show has an infinite deviation, and one that is not known is NaN.
    for name in ("std", "relative_std"):
        arrays[name] = checked.array(group[name], (size,), finite=False)
    if {len(each) for each in texts.values()} != {size}:
        raise ValueError("its parameters lack units or words")
    phi = checked.array(file["bodies/phi"], (None,))
    consistent = file["bodies"].get("consistent")
    return Fit(
        method=checked.text(settings, "method"),
        inertias=checked.text(settings, "inertias"),
        joint_names=joints,
        effects=effects,
        rank=rank,
        names=names,
        values=checked.array(group["values"], (size,)),
        covariance=checked.array(group["covariance"], (size, size), finite=False),
        noise=checked.array(file["noise"], (len(joints),), finite=False),
        phi=phi,
        count=checked.count(settings, "count"),
        # Of earlier versions some say more than there are.
        samples=min(checked.number(settings, "samples"), checked.count(settings, "count")),
        consistent=_consistent(consistent, len(phi), size - rank),
        links=_links(consistent, len(phi) // 10),
        # Files of earlier versions fitted all of them.
        kept=checked.texts(settings["kept"], "kept") if "kept" in settings else (),
        **texts,
        **arrays,
    )


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


def _consistent(group: Any, phi: int, effects: int) -> ConsistentParameters | None:
    if group is None:
        return None
    return ConsistentParameters(
        phi=checked.array(group["phi"], (phi,)),
        effects=checked.array(group["effects"], (effects,)),
        eigenvalues=checked.array(group["eigenvalues"], (None,)),
        cost=checked.number(group.attrs, "cost"),
        status=checked.text(group.attrs, "status"),
        solved=checked.flag(group.attrs, "solved"),
        # Files of earlier versions took the prior as it was given.
        spread=checked.number(group.attrs, "spread") if "spread" in group.attrs else 1.0,
    )


def _links(group: Any, bodies: int) -> tuple[LinkChange, ...]:
    """What changed per link; files of earlier versions have none."""
    if group is None or "links" not in group:
        return ()
    links = checked.record(group["links"][()], tuple[LinkChange, ...])
    if len(links) not in (0, bodies):
        raise ValueError("'links' are not those of its bodies")
    return tuple(links)


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
