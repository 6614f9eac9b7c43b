"""Everything that was identified as YAML: what URDF and MJCF cannot hold is here.

The list `effects` can be copied into a problem as it stands; `identified` holds values, standard
deviations and noise.
"""

import math
from collections.abc import Sequence
from typing import Any

from excite_cli.config.plain_yaml import yaml_text
from excite_cli.dynamics.regressor import PARAMETER_NAMES, PARAMETERS_PER_BODY
from excite_cli.effects.base import Effect
from excite_cli.identification.fit import Fit
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
