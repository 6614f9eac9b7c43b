"""Everything that was identified as YAML: what URDF and MJCF cannot hold is here.

The list `effects` can be copied into a problem as it stands; `identified` holds values, standard
deviations and noise.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import asdict, fields
from math import isfinite
from pathlib import Path
from typing import Any

from excite_cli.config.plain_yaml import yaml_text
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.dynamics.regressor import PARAMETER_NAMES, PARAMETERS_PER_BODY
from excite_cli.effects.base import Effect
from excite_cli.identification.fit import Fit
from excite_cli.identification.processing import Processing
from excite_cli.robot.model import Robot

_DIGITS = 10


def parameters_yaml(robot: Robot, fit: Fit) -> str:
    """The YAML text."""
    tree = {
        "effects": effect_specs(fit.effects, fit.joint_names),
        "identified": {
            "robot": robot.name,
            "fingerprint": robot.fingerprint(),
            "method": fit.method,
            "inertias": fit.inertias,
            "noise": {
                name: _plain(value) for name, value in zip(fit.joint_names, fit.noise, strict=True)
            },
            "base_parameters": {
                name: {
                    "value": _plain(fit.values[i]),
                    "std": _plain(fit.std[i]),
                    "unit": fit.units[i],
                    "identifiable": bool(fit.identifiable[i]),
                    "groups": fit.words[i],
                }
                for i, name in enumerate(fit.names[: fit.rank])
            },
            "effects": [_effect(fit, i) for i in range(len(fit.effects))],
            "bodies": _bodies(robot, fit),
        },
    }
    return yaml_text(
        tree,
        "Identified by excite. `effects` can be copied into a problem; units: rad, s, N·m, kg, m.\n"
        "bodies: standard parameters about the joint's frame"
        + (", physically consistent." if fit.consistent is not None else "."),
    )


def effect_specs(effects: Sequence[Effect], joint_names: Sequence[str]) -> list[dict[str, Any]]:
    """Effects as the entries of `effects:`; alike but for joints, they share an entry."""
    entries: list[dict[str, Any]] = []
    for effect in effects:
        joints = [joint_names[j] for j in effect.joints]
        entry: dict[str, Any] = {"kind": effect.kind, "joints": joints}
        if effect.shape:
            entry["shape"] = {key: float(value) for key, value in effect.shape.items()}
        if effect.runs:
            entry["runs"] = list(effect.runs)
        if effect.covariate:
            entry["covariate"] = effect.covariate
        rest = {key: value for key, value in entry.items() if key != "joints"}
        like = next(
            (
                other
                for other in entries
                if effect.scope == "joint"
                and {key: value for key, value in other.items() if key != "joints"} == rest
            ),
            None,
        )
        if like is None:
            entries.append(entry)
        else:
            like["joints"] += joints
    return entries


def _effect(fit: Fit, index: int) -> dict[str, Any]:
    effect = fit.effects[index]
    entry: dict[str, Any] = {
        "kind": effect.kind,
        "joints": [fit.joint_names[j] for j in effect.joints],
        "parameters": {
            name: {"value": _plain(found.value), "std": _plain(found.std), "unit": found.unit}
            for name, found in fit.effect_report(index).items()
        },
    }
    if fit.consistent is not None:
        entry["consistent_values"] = [_plain(x) for x in fit.consistent_effect_values(index)]
    return entry


def _bodies(robot: Robot, fit: Fit) -> dict[str, dict[str, Any]]:
    names = [str(name) for name in robot.model.names[1:]]
    bodies = fit.best_phi().reshape(-1, PARAMETERS_PER_BODY)
    return {
        name: {symbol: _plain(x) for symbol, x in zip(PARAMETER_NAMES, ten, strict=True)}
        for name, ten in zip(names, bodies, strict=True)
    }


def _plain(value: float) -> float | None:
    """A rounded number; None (null) where there is none."""
    number = float(value)
    return float(f"{number:.{_DIGITS}g}") if math.isfinite(number) else None


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
            name: {
                joint: x if isfinite(x) else None for joint, x in getattr(found.after, name).items()
            }
            for name in figures
        },
        "noise": {joint: x for joint, x in (found.noise_floor or {}).items() if isfinite(x)},
        "processing": {name: x for name, x in found.processing.items() if name in filters},
    }


def _of_effect(record: EffectRecord) -> dict[str, Any]:
    told = {name: x for name, x in asdict(record).items() if x and name != "link"}
    return {name: list(x) if isinstance(x, tuple) else x for name, x in told.items()}
