"""Identified models for simulators: the part of `excite export` that is about models."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from excite_cli.atomic import write_folder_atomically, write_text_atomically
from excite_cli.config.load_spec import files_of_config
from excite_cli.diagnosis.reduced_model import reduced_model
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, body_lengths, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.errors import ConfigError, FileError
from excite_cli.export import actuator_configs, mjcf, urdf
from excite_cli.export.actuator_configs import joint_values
from excite_cli.export.c_model import c_model
from excite_cli.export.drive import Drive, drive_of
from excite_cli.export.exported import OF_DRIVES, ModelText, in_words, with_straight_friction
from excite_cli.export.held_out import HeldOutErrors, held_out_errors, torque_left
from excite_cli.export.parameters import parameters_yaml
from excite_cli.export.randomization import quantities, randomization
from excite_cli.export.ros2_package import ModelFolder, package_name, ros2_package
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.identification.fit import Fit, effect_parameters
from excite_cli.identification.identified_model import IdentifiedModel, as_described
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.uncertain_model import (
    UncertainModel,
    from_covariance,
    from_information,
    uncertain,
)
from excite_cli.robot.model import Array, Robot
from excite_cli.scoring.validity import Trust
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.fit_file import read_fit
from excite_cli.store.model_file import consistent_model, read_model
from excite_cli.store.score_file import read_thresholds


@dataclass(frozen=True)
class ModelRequest:
    """A model's file as `format` in `path`; `thresholds` (C), `samples` and `seed` (randomization).

    The last two are None where nobody asked for them.
    """

    file: Path
    format: str
    path: Path
    thresholds: Path | None = None
    samples: int | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        """Raise ConfigError for options of other formats."""
        for option, value in (("--samples", self.samples), ("--seed", self.seed)):
            if value is not None and self.format != "randomization":
                raise ConfigError(f"{option}: only --format randomization draws samples.")
        if self.samples is not None and not 1 <= self.samples <= MOST_SAMPLES:
            raise ConfigError(f"--samples {self.samples}: allowed: 1 to {MOST_SAMPLES:,}.")


MOST_SAMPLES = 100_000
_SAMPLES, _SEED = 100, 1


def write_requested(wanted: ModelRequest, tell: Tell) -> HeldOutErrors | None:
    """A fit, a diagnosis or a config with its numbers as a file of another program.

    URDF and MJCF hold physically consistent bodies, and straight friction where they have no form
    for what was found; C is the model that the table of errors belongs to. Of URDF and MJCF the
    errors on held-out data, where the model has kept such.
    """
    stored = read_model(wanted.file)
    config = wanted.file if stored.what in ("config", "urdf") else None
    own = files_of_config(stored.spec, stored.folder, config)
    refuse_inputs_as_outputs({"--output": wanted.path}, (*own, *stored.sources))
    robot, format, path = stored.robot, wanted.format, wanted.path
    if format in ("c", "ros2-package"):
        names = robot.joint_names
        limits = None if wanted.thresholds is None else read_thresholds(wanted.thresholds, names)
        trust = Trust(stored) if stored.traces else None
        c_file = c_model(robot, stored.model, "", limits, trust)
        if format == "c":
            write_exported(c_file, path, tell)
        else:
            name = package_name(path.name)
            write_exported(ros2_package(robot, stored.model, c_file, name), path, tell)
    elif format in OF_DRIVES:
        write_exported(_actuators(stored, format, path, tell), path, tell)
    elif format == "randomization":
        write_exported(_randomization(stored, wanted), path, tell)
    elif format != "yaml":
        model = _simple(stored, format, path, tell)
        write_model(robot, model, format, path, tell, drive_of(stored.spec, robot.joint_names))
        described = as_described(robot)
        return held_out_errors(robot, stored.traces, model, _HOLDS[format], described)
    elif stored.what == "fit":
        write_models(robot, read_fit(wanted.file).fit, {"parameters": path}, tell)
    else:
        raise FileError(
            f"{wanted.file} is not a fit; --format yaml takes fits only (write one "
            "with excite identify -o)."
        )
    return None


def _simple(stored: StoredModel, format: str, path: Path, tell: Tell) -> IdentifiedModel:
    model, notes = for_simulators(stored, format)
    for note in notes:
        tell(Note(Level.NOTE, f"{path}: {note}"))
    return model


def _actuators(stored: StoredModel, format: str, path: Path, tell: Tell) -> ModelText:
    """Actuator configs of a robot that follows set points."""
    robot = stored.robot
    drive = drive_of(stored.spec, robot.joint_names)
    if drive is None:
        raise FileError(
            f"{stored.path}: --format {format} holds drives that follow set points, and this "
            "robot's torque was measured. Take mjcf or urdf, or identify with "
            "measurement.torque: command."
        )
    if format == "bam":
        model = _simple(stored, "bam", path, tell)
        return actuator_configs.bam(robot, model, joint_values(robot, model, drive))
    values = joint_values(robot, _simple(stored, "mjcf", path, tell), drive)
    written = actuator_configs.isaaclab if format == "isaaclab" else actuator_configs.mjlab
    return written(robot.name, values)


def _randomization(stored: StoredModel, wanted: ModelRequest) -> ModelText:
    """Correlated ranges and samples of the robot's numbers."""
    robot = stored.robot
    found = uncertain_model(stored)
    drive: Drive | None = drive_of(stored.spec, robot.joint_names)
    straight = bool(with_straight_friction(stored, found.model, mjcf.holds)[1])

    def simplify(model: IdentifiedModel) -> IdentifiedModel:
        return with_straight_friction(stored, model, mjcf.holds)[0] if straight else model

    count, seed = wanted.samples or _SAMPLES, _SEED if wanted.seed is None else wanted.seed
    y = quantities(robot, found.model, simplify, drive)
    delay = None if drive is None else drive.delay
    notes = ["samples are drawn among robots that can be: no link is moved to the border for it"]
    if stored.model.of_single_runs:
        notes.append("effects of single recordings are not in it")
    left = torque_left(robot, stored.traces, simplify(found.model), mjcf.holds)
    return ModelText(randomization(y, found, count, seed, delay, left), tuple(notes))


def uncertain_model(stored: StoredModel) -> UncertainModel:
    """The model that simulators get, with its covariance; without effects of single recordings.

    Raises
    ------
    FileError, ConfigError
        It has no covariance; no robot like it can exist.
    """
    robot = stored.robot
    base, cad = find_base_parameters(robot), standard_parameters(robot)
    spec = stored.spec.identification
    share = spec.uncertainty if spec.inertias == "cad" else UNSURE
    prior = inertial_prior(robot, cad, share)
    if stored.what == "fit":
        fit = read_fit(stored.path).fit
        model, estimate = fit.best_model, fit.model
        root = from_covariance(base, prior, fit.covariance)
    elif stored.what == "diagnosis":
        reduced = reduced_model(read_diagnosis(stored.path), robot, mjcf.holds, stored.path)
        if reduced is None:
            raise ConfigError(
                f"{stored.path}: no robot like its model can exist. Diagnose again with more data."
            )
        model, estimate = reduced.model, reduced.estimate
        root = from_information(base, prior, reduced.factor)
    else:
        raise FileError(
            f"{stored.path} holds no covariance. Give the fit (excite identify -o) or the "
            "diagnosis (excite diagnose -o)."
        )
    kept = np.array(
        [True] * len(model.phi)
        + [not effect.runs for effect in model.effects for _ in effect.parameters]
    )
    center = np.concatenate([estimate.phi, estimate.values])[kept]
    model = model.without(model.of_single_runs)
    signs = np.array([p.nonnegative for p in effect_parameters(model.effects)], bool)
    return uncertain(
        model, center, root[kept], _carry(robot, model), body_lengths(robot, cad), signs
    )


def _carry(robot: Robot, model: IdentifiedModel) -> Array:
    """What one unit of each effect's parameter adds to φ (P, k)."""
    units = np.eye(len(model.values))
    columns = [IdentifiedModel(model.phi, model.effects, unit).carried(robot) for unit in units]
    return np.stack(columns, axis=1) if columns else np.zeros((len(model.phi), 0))


# Identified models as files: URDF, MJCF, YAML of all parameters.

_HOLDS = {"urdf": urdf.holds, "mjcf": mjcf.holds, "bam": actuator_configs.holds}


def write_models(
    robot: Robot,
    fit: Fit,
    paths: Mapping[str, str | Path | None],
    tell: Tell,
    drive: Drive | None = None,
) -> None:
    """Write `fit` to the paths that are given: `urdf`, `mjcf`, `parameters` (YAML).

    What a format cannot hold is reported. `drive`: what the robot's set points are followed by.
    """
    for kind, path in paths.items():
        if path is not None and kind == "parameters":
            write_text_atomically(Path(path), parameters_yaml(robot, fit))
        elif path is not None:
            write_model(robot, fit.best_model, kind, Path(path), tell, drive)


def for_simulators(stored: StoredModel, kind: str) -> tuple[IdentifiedModel, tuple[str, ...]]:
    """A model with bodies that can be, and with effects that `kind` holds; notes of that."""
    model, dropped = _held(stored, kind)
    notes = []
    if dropped:
        words = in_words(dropped, stored.robot.joint_names)
        notes.append(f"{kind.upper()} cannot hold: {words}. The rest was fitted again without them")
    model, joints = with_straight_friction(stored, model, _HOLDS[kind])
    if joints:
        notes.append(
            f"friction of {', '.join(joints)} is approximated by viscous and Coulomb friction, as "
            f"{kind.upper()} cannot hold its form"
        )
    return model, tuple(notes)


def _held(stored: StoredModel, kind: str) -> tuple[IdentifiedModel, tuple[Effect, ...]]:
    """The model without effects that neither `kind` nor MuJoCo holds, and these.

    So rotors and springs, which a URDF cannot hold, are not taken for inertias.
    """
    if stored.what != "diagnosis":
        return consistent_model(stored), ()

    def holds(effect: Effect, values: Array) -> bool:
        return _HOLDS[kind](effect, values) or mjcf.holds(effect, values)

    reduced = reduced_model(read_diagnosis(stored.path), stored.robot, holds, stored.path)
    return (stored.model, ()) if reduced is None else (reduced.model, reduced.dropped)


def write_model(
    robot: Robot,
    model: IdentifiedModel,
    kind: str,
    path: Path,
    tell: Tell,
    drive: Drive | None = None,
) -> None:
    """Write a model as `kind`: `urdf` or `mjcf`; what that cannot hold is reported."""
    if kind == "urdf":
        write_exported(urdf.updated_urdf(robot, model), path, tell)
    else:
        write_exported(mjcf.mjcf(robot, model, drive), path, tell)


def write_exported(exported: ModelText | ModelFolder, path: Path, tell: Tell) -> None:
    """Write a model's text, or the files of its folder, and report what is not in it."""
    if isinstance(exported, ModelText):
        write_text_atomically(path, exported.text)
    else:
        write_folder_atomically(path, exported.fill)
    for note in exported.notes:
        tell(Note(Level.NOTE, f"{path}: {note}"))
