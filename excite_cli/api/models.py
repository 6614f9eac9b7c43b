"""Identified models as files: URDF, MJCF, YAML of all parameters."""

from collections.abc import Callable, Mapping
from pathlib import Path

from excite_cli.atomic import write_text_atomically
from excite_cli.export.exported import IdentifiedModel, ModelText
from excite_cli.export.mjcf import mjcf
from excite_cli.export.parameters import parameters_yaml
from excite_cli.export.urdf import updated_urdf
from excite_cli.identification.fit import Fit
from excite_cli.robot.model import Robot
from excite_cli.shown.note import Level, Note, Tell

_WRITERS: dict[str, Callable[[Robot, IdentifiedModel], ModelText]] = {
    "urdf": updated_urdf,
    "mjcf": mjcf,
}


def write_models(
    robot: Robot, fit: Fit, paths: Mapping[str, str | Path | None], tell: Tell
) -> None:
    """Write `fit` to the paths that are given: `urdf`, `mjcf`, `parameters` (YAML).

    What a format cannot hold is reported.
    """
    count = range(len(fit.effects))
    values = tuple(fit.consistent_effect_values(i) for i in count)
    model = IdentifiedModel(fit.best_phi(), fit.effects, values)
    for kind, path in paths.items():
        if path is None:
            continue
        if kind == "parameters":
            write_text_atomically(Path(path), parameters_yaml(robot, fit))
            continue
        exported = _WRITERS[kind](robot, model)
        write_text_atomically(Path(path), exported.text)
        for note in exported.notes:
            tell(Note(Level.NOTE, f"{path}: {note}"))
