"""Rows of numbers of the records that have them: what `record.table(…)` makes a DataFrame of."""

from collections.abc import Iterable, Mapping
from typing import Any

from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.dynamics.regressor import standard_parameter_unit
from excite_cli.effects.base import Value
from excite_cli.fields import data_of
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.identify import Identification
from excite_cli.identification.stored_model import StoredFit
from excite_cli.shown.answer import Tables
from excite_cli.summary.error_by_joint import errors_by_model

Rows = list[dict[str, Any]]


def _effect(
    kind: str, joints: Iterable[str], values: Mapping[str, Value], named: NamedEffect | None = None
) -> Rows:
    """A row for every number of an effect, with the evidence of one that was found."""
    evidence = ("p_value", "share_of_residual", "gain", "error_reduction", "verdict")
    more = data_of(named, *evidence) if named else {}
    own = {"effect": kind, "joints": ", ".join(joints)}
    return [{**own, "parameter": name, **data_of(x), **more} for name, x in values.items()]


def _of_fit(fit: Fit) -> Rows:
    report = ((each, fit.effect_report(k)) for k, each in enumerate(fit.effects))
    every = (_effect(e.kind, (fit.joint_names[j] for j in e.joints), x) for e, x in report)
    return [row for rows in every for row in rows]


def _found(found: Diagnosis) -> Rows:
    every = (_effect(e.effect.kind, e.effect.joints, e.parameters, e) for e in found.effects)
    return [row for rows in every for row in rows]


def _errors(models: Mapping[str, Errors], joints: Iterable[str], units: Iterable[str]) -> Rows:
    """A row for every joint: of each model the error where it moves, a share, and its RMS."""
    return [
        {
            "joint": joint,
            **{f"error_{name}": e.relative_moving[joint] for name, e in models.items()},
            **{f"rms_{name}": (e.rms_moving or e.rms)[joint] for name, e in models.items()},
            "unit": unit,
        }
        for joint, unit in zip(joints, units, strict=True)
    ]


def _errors_of_fit(found: Identification | StoredFit) -> Rows:
    models = {"held_out": found.error, "training": found.training_error}
    return _errors(models, found.fit.joint_names, found.torque_units)


def _errors_found(found: Diagnosis) -> Rows:
    models = {key.lower().replace(" ", "_"): e for key, e in errors_by_model(found).items()}
    return _errors(models, found.joint_names, found.torque_units)


def _parameters(fit: Fit) -> Rows:
    keys = ("parameter", "value", "std", "unit", "relative_std", "identifiable", "essential")
    columns = (fit.names, fit.values, fit.std, fit.units, fit.relative_std, fit.identifiable)
    return [dict(zip(keys, row, strict=True)) for row in zip(*columns, fit.essential, strict=True)]


def _inertias(found: Diagnosis) -> Rows:
    return [
        {"parameter": name, "value": value, "unit": standard_parameter_unit(k)}
        for k, (name, value) in enumerate(zip(found.inertia_names, found.phi, strict=False))
    ]


OF_DIAGNOSIS: Tables = {"effects": _found, "errors": _errors_found, "parameters": _inertias}
OF_FIT: Tables = {"effects": _of_fit, "parameters": _parameters}
OF_IDENTIFICATION: Tables = {
    "effects": lambda found: _of_fit(found.fit),
    "errors": _errors_of_fit,
    "parameters": lambda found: _parameters(found.fit),
}
