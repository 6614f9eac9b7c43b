"""Reading models: a fit, a diagnosis, or a config that holds its numbers."""

from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.config.load_spec import load_spec, parse_spec
from excite_cli.config.spec import IdentifiedSpec, Spec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, by_joint
from excite_cli.diagnosis.reduced_model import reduced_model
from excite_cli.dynamics.regressor import standard_parameter_names
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ConfigError, FileError
from excite_cli.given_files import require_stored
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.factors import triangle_of
from excite_cli.identification.identified_model import IdentifiedModel, as_described
from excite_cli.identification.processing import processing_of
from excite_cli.identification.stored_model import StoredModel
from excite_cli.robot.model import Array, Robot, build_measured_robot
from excite_cli.store.diagnosis_file import is_diagnosis, read_diagnosis
from excite_cli.store.fit_file import is_fit, read_fit
from excite_cli.store.own_file import is_own

_TEXT = {".yaml", ".yml"}


def read_model(path: Path) -> StoredModel:
    """Read a model: a fit, a diagnosis, or a config (`--apply`, or the URDF as it is).

    Raises
    ------
    FileError
        The file is missing, is none of these, or was made with another robot than its URDF is now.
    ConfigError, RobotError
        The config cannot be, or declares effects and has no values for them.
    """
    require_stored(path)
    if not path.is_file():
        raise FileError(f"There is no file {path}.")
    if is_fit(path):
        return _of_fit(path)
    if is_diagnosis(path):
        return _of_diagnosis(path)
    if is_own(path):
        raise FileError(
            f"{path} holds no model. Give a fit (`excite identify -o`), a diagnosis (`excite "
            "diagnose -o`), or a config that `excite diagnose --apply` wrote."
        )
    return _of_config(path)


def _of_fit(path: Path) -> StoredModel:
    stored = read_fit(path)
    spec, folder, robot = _robot(path, stored.config, stored.config_folder, stored.fingerprint)
    fit = stored.fit
    if fit.joint_names != robot.joint_names or len(fit.phi) != 10 * robot.n_bodies:
        raise _other_bodies(path)
    noise = stored.noise_floor or dict(zip(fit.joint_names, map(float, fit.noise), strict=True))
    return StoredModel(
        path, "fit", spec, folder, robot, fit.model, stored.held_out_run, stored.error, noise,
        processing_of(stored.processing), stored.traces, fit.best_model,
        _information(fit.covariance), stored.sources,
    )  # fmt: skip


def _of_diagnosis(path: Path) -> StoredModel:
    found = read_diagnosis(path)
    spec, folder, robot = _robot(path, found.config, found.config_folder, found.fingerprint)
    if found.joint_names != robot.joint_names or len(found.phi) != 10 * robot.n_bodies:
        raise _other_bodies(path)
    records = [*found.declared, *(named.effect for named in found.effects)]
    noise = found.noise_floor or _by_joint(found.processing.get("noise_rms"), robot)
    trained = () if found.traces is None else found.traces.runs
    return StoredModel(
        path, "diagnosis", spec, folder, robot, _model(found.phi, records, robot, path),
        found.held_out_run, found.after, noise, processing_of(found.processing),
        (*trained, *found.held_out_traces), factor=_own_factor(found),
    )  # fmt: skip


def _own_factor(found: Diagnosis) -> Array | None:
    """Of the model's own columns; None where the information is that of other effects."""
    order = found.information.columns_of(
        (*found.declared, *(named.effect for named in found.effects))
    )
    return None if order is None else triangle_of(found.information.factor[:, order])


def _information(covariance: Array) -> Array:
    """R (p, p) with RᵀR the inverse of a covariance; zero for what is not known (infinite)."""
    known = np.isfinite(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance[np.ix_(known, known)])
    rows = vectors.T / np.sqrt(np.maximum(values, 1e-300))[:, None]
    factor = np.zeros_like(covariance)
    factor[np.ix_(known, known)] = rows
    return factor


def consistent_model(stored: StoredModel) -> IdentifiedModel:
    """The model with bodies that can be; as it is where nothing tells better.

    A fit has them; of a diagnosis they are those nearest to the URDF's that its data allow.
    """
    if stored.consistent is not None or stored.what != "diagnosis":
        return stored.consistent or stored.model
    reduced = reduced_model(read_diagnosis(stored.path), stored.robot, lambda *_: True, stored.path)
    return stored.model if reduced is None else reduced.model


def is_text(path: Path) -> bool:
    """Whether `path` is called as configs are."""
    return path.suffix.lower() in _TEXT


def _of_config(path: Path) -> StoredModel:
    if not is_text(path):
        raise FileError(
            f"{path} is no model: give a fit or a diagnosis (HDF5), or a config (YAML)."
        )
    spec, folder = load_spec(path, []), path.resolve().parent
    robot, told = build_measured_robot(spec.robot, folder), spec.identified
    if told is not None:
        return _of_numbers(path, spec, folder, robot, told)
    if spec.effects:
        raise ConfigError(
            f"{path}: it declares effects and holds no values for them (`identified`). Give the "
            "fit or the diagnosis, or a config that `excite diagnose --apply` wrote."
        )
    described = as_described(robot)
    if described is None:
        raise ConfigError(f"{path}: the URDF has no masses, so it predicts no torque.")
    return StoredModel(path, "urdf", spec, folder, robot, described)


def _of_numbers(
    path: Path, spec: Spec, folder: Path, robot: Robot, told: IdentifiedSpec
) -> StoredModel:
    names = standard_parameter_names(robot)
    unknown = [name for name in told.inertias if name not in names]
    missing = [name for name in names if name not in told.inertias]
    if unknown or missing:
        what = f"unknown: {', '.join(unknown[:3])}" if unknown else f"missing: {missing[0]}"
        raise ConfigError(
            f"{path}: identified.inertias are not those of the robot ({what}). Diagnose again."
        )
    records = [
        EffectRecord(
            each.kind, each.joints, dict(each.shape), each.values, each.runs,
            covariate=each.covariate,
        )
        for each in told.effects
    ]  # fmt: skip
    phi = np.array([told.inertias[name] for name in names])
    return StoredModel(
        path, "config", spec, folder, robot, _model(phi, records, robot, path), told.held_out_run,
        _errors(told), dict(told.noise), processing_of(dict(told.processing)),
    )  # fmt: skip


def _errors(told: IdentifiedSpec) -> Errors | None:
    """What is known of the errors; the rest is NaN."""
    if not told.error:
        return None
    known = {
        name: {joint: nan if x is None else x for joint, x in by_joint.items()}
        for name, by_joint in told.error.items()
    }

    def mean(name: str) -> float:
        values = [x for x in known.get(name, {}).values() if x == x]
        return float(np.mean(values)) if values else nan

    return Errors(
        mean("relative"),
        mean("relative_moving"),
        known.get("relative", {}),
        known.get("relative_moving", {}),
        known.get("rms", {}),
        {},
        (nan, nan),
        rms_moving=known.get("rms_moving", {}),
    )


def _robot(path: Path, config: str, folder: str, fingerprint: str) -> tuple[Spec, Path, Robot]:
    spec = parse_spec(config, f"the config stored in {path}")
    robot = build_measured_robot(spec.robot, Path(folder))
    if robot.fingerprint() != fingerprint:
        raise FileError(
            f"{path} was made with another robot than the URDF gives now ({spec.robot.urdf}). "
            "Identify again."
        )
    return spec, Path(folder), robot


def _other_bodies(path: Path) -> FileError:
    return FileError(
        f"{path} holds parameters of other joints or bodies than its config. Identify again."
    )


def _model(phi: Any, records: list[EffectRecord], robot: Robot, path: Path) -> IdentifiedModel:
    effects: list[Effect] = []
    for record in records:
        kind = kind_named(record.kind, str(path))
        if len(record.values) != len(kind.parameters):
            raise FileError(
                f"{path}: the effect '{record.kind}' has no {len(record.values)} values."
            )
        if not set(record.joints) <= set(robot.joint_names):
            raise FileError(f"{path}: the effect '{record.kind}' acts on joints of another robot.")
        effects.append(effect_of(record, robot.joint_names))
    values = [np.asarray(record.values, dtype=float) for record in records]
    return IdentifiedModel(np.asarray(phi), tuple(effects), np.concatenate([np.zeros(0), *values]))


def _by_joint(values: Any, robot: Robot) -> dict[str, float] | None:
    if not isinstance(values, list) or len(values) != robot.n:
        return None
    return by_joint(robot.joint_names, values)
