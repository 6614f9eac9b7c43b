"""Identified models as files: URDF, MJCF, YAML of all parameters."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from excite_cli.export.exported import Exported
    from excite_cli.identification.fit import Fit
    from excite_cli.robot.model import Robot


def write_models(
    robot: "Robot",
    fit: "Fit",
    urdf: Path | None = None,
    mjcf: Path | None = None,
    parameters: Path | None = None,
) -> list[str]:
    """Write what was asked for; return what must be said about it."""
    from excite_cli.atomic import write_text_atomically
    from excite_cli.export.exported import IdentifiedModel
    from excite_cli.export.mjcf import mjcf as as_mjcf
    from excite_cli.export.parameters import parameters_yaml
    from excite_cli.export.urdf import updated_urdf

    count = range(len(fit.effects))
    values = tuple(fit.consistent_effect_values(i) for i in count)
    model = IdentifiedModel(fit.best_phi(), fit.effects, values)
    writers: list[tuple[Path | None, Callable[..., Exported]]] = [
        (urdf, updated_urdf),
        (mjcf, as_mjcf),
    ]
    notes = []
    for path, writer in writers:
        if path is not None:
            exported = writer(robot, model)
            write_text_atomically(path, exported.text)
            notes += [f"{path}: {note}" for note in exported.notes]
    if parameters is not None:
        write_text_atomically(parameters, parameters_yaml(robot, fit))
    return notes
