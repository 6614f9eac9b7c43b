"""The problem of a config with the effects that a diagnosis found in it."""

import os
from dataclasses import asdict, fields
from math import isfinite
from pathlib import Path
from typing import Any

from excite_cli.config.plain_yaml import yaml_text
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.export.parameters import effect_specs
from excite_cli.identification.processing import Processing


def found_config(
    spec: Spec,
    folder: Path,
    found: Diagnosis,
    path: Path,
    textbook: bool = False,
) -> str:
    """YAML text of `spec`, its effects the declared ones and those that were found.

    Or the `textbook`'s in their place.

    Relative paths of `spec` start from `folder`; those of the text start from the folder of `path`,
    where it is to be written.
    """
    tree = spec.model_dump(mode="json", exclude_unset=True)
    target = path.resolve().parent
    urdf = spec.robot.urdf
    if ":" not in urdf and not Path(urdf).is_absolute():
        tree["robot"]["urdf"] = os.path.relpath(folder / urdf, target)
    if spec.robot.package_dirs:
        tree["robot"]["package_dirs"] = [
            os.path.relpath(folder / each, target) for each in spec.robot.package_dirs
        ]
    added = [named.effect for named in found.effects]
    after = found.after.mean_relative_moving
    if textbook and found.textbook is not None:
        added, after = list(found.textbook.effects), found.textbook.error.mean_relative_moving
    records = [*found.declared, *added]
    effects = [effect_of(record, found.joint_names) for record in records]
    tree["effects"] = effect_specs(effects, found.joint_names)
    # Of fewer effects the values would be others; files of earlier versions do not name inertias.
    if not textbook and len(found.inertia_names) == len(found.phi):
        tree["identified"] = _identified(found, records)
    whence = "of the textbook's model" if textbook else "found by `excite diagnose`"
    comment = (
        f"{len(added)} effects {whence}, added to the declared model.\n"
        f"Mean relative error on {found.held_out_run}: {found.before.mean_relative_moving:.2%} "
        f"before, {after:.2%} after (moving samples)."
    )
    return yaml_text(tree, comment)


def _identified(found: Diagnosis, records: list[EffectRecord]) -> dict[str, Any]:
    """The model with its numbers, for who plays it (`identified`)."""
    figures = ("relative", "relative_moving", "rms", "rms_moving")
    filters = {field.name for field in fields(Processing)} - {"reasons"}
    return {
        "inertias": dict(zip(found.inertia_names, map(float, found.phi), strict=True)),
        "effects": [_of_effect(record) for record in records],
        "held_out_run": found.held_out_run,
        "error": {
            name: {joint: _known(x) for joint, x in getattr(found.after, name).items()}
            for name in figures
        },
        "noise": {joint: x for joint, x in (found.noise_floor or {}).items() if isfinite(x)},
        "processing": {name: x for name, x in found.processing.items() if name in filters},
    }


def _of_effect(record: EffectRecord) -> dict[str, Any]:
    told = {name: x for name, x in asdict(record).items() if x and name != "link"}
    return {name: list(x) if isinstance(x, tuple) else x for name, x in told.items()}


def _known(x: float) -> float | None:
    return x if isfinite(x) else None
