"""Identified models as files: URDF, MJCF, YAML of all parameters."""

from collections.abc import Mapping
from pathlib import Path

from excite_cli.atomic import write_text_atomically
from excite_cli.export import mjcf, urdf
from excite_cli.export.drive import Drive
from excite_cli.export.exported import ModelText
from excite_cli.export.parameters import parameters_yaml
from excite_cli.identification.fit import Fit
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.stored_model import StoredModel
from excite_cli.robot.model import Robot
from excite_cli.scoring.straight_friction import with_straight_friction
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.store.model_file import consistent_model

_HOLDS = {"urdf": urdf.holds, "mjcf": mjcf.holds}


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
    """A model with bodies that can be, and with friction of a form that `kind` holds; a note."""
    model = consistent_model(stored)
    model, joints = with_straight_friction(stored, model, _HOLDS[kind])
    if not joints:
        return model, ()
    text = (
        f"friction of {', '.join(joints)} is approximated by viscous and Coulomb friction, as "
        f"{kind.upper()} has no other"
    )
    return model, (text,)


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


def write_exported(exported: ModelText, path: Path, tell: Tell) -> None:
    """Write a model's text, and report what is not in it."""
    write_text_atomically(path, exported.text)
    for note in exported.notes:
        tell(Note(Level.NOTE, f"{path}: {note}"))
