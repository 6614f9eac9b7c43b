"""What records offer in Python: rows of numbers, of which DataFrames are made, and plots."""

from collections.abc import Iterable, Mapping
from itertools import chain, count
from typing import Any

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.regressor import standard_parameter_unit
from excite_cli.effects.base import Value
from excite_cli.fields import data_of
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.report.record_plots import plot_friction, plot_residual
from excite_cli.shown.answer import Offers
from excite_cli.summary.effect_evidence import friction_clouds
from excite_cli.summary.error_by_joint import errors_by_model

Rows = list[dict[str, Any]]
_EVIDENCE = ("p_value", "share_of_residual", "gain", "error_reduction", "verdict")


def _effect(kind: str, joints: Iterable[str], values: Mapping[str, Value], **more: Any) -> Rows:
    """A row for every number of an effect."""
    own = {"effect": kind, "joints": ", ".join(joints)}
    return [{**own, "parameter": name, **data_of(x), **more} for name, x in values.items()]


def _found(found: Diagnosis) -> Rows:
    every = ((each.effect, each, data_of(each, *_EVIDENCE)) for each in found.effects)
    rows = (_effect(e.kind, e.joints, each.parameters, **more) for e, each, more in every)
    return [*chain(*rows)]


def _of_fit(fit: Fit) -> Rows:
    names = [[fit.joint_names[j] for j in effect.joints] for effect in fit.effects]
    every = zip(fit.effects, names, map(fit.effect_report, count()), strict=False)
    return [*chain(*(_effect(e.kind, joints, values) for e, joints, values in every))]


def _errors(models: Mapping[str, Errors], joints: Iterable[str], units: Iterable[str]) -> Rows:
    """A row for every joint: of each model the error where it moves, a share, and its RMS."""
    rows = []
    for joint, unit in zip(joints, units, strict=True):
        row: dict[str, Any] = {"joint": joint, "unit": unit}
        for head, each in models.items():
            name = head.lower().replace(" ", "_")
            row[f"error_{name}"] = each.relative_moving[joint]
            row[f"rms_{name}"] = (each.rms_moving or each.rms)[joint]
        rows.append(row)
    return rows


def parameters_of(fit: Fit) -> Rows:
    """A row for each, base parameters first."""
    columns = ("values", "std", "relative_std", "identifiable", "essential", "units")
    keys = ("name", "value", *columns[1:-1], "unit")
    table = zip(fit.names, *(data_of(getattr(fit, name)) for name in columns), strict=True)
    return [dict(zip(keys, row, strict=True)) for row in table]


OF_DIAGNOSIS: Offers = {
    "effects": _found,
    "errors": lambda x: _errors(errors_by_model(x), x.joint_names, x.torque_units),
    "parameters": lambda x: [
        {"name": name, "value": value, "unit": standard_parameter_unit(k)}
        for k, (name, value) in enumerate(zip(x.inertia_names, x.phi, strict=False))
    ],
    "plot_residual": plot_residual,
    "plot_friction": lambda x, *of: plot_friction(friction_clouds(x, x.traces), *of),
}
OF_FIT: Offers = {"effects": _of_fit, "parameters": parameters_of}
OF_IDENTIFICATION: Offers = {
    "effects": lambda x: _of_fit(x.fit),
    "errors": lambda x: _errors(
        {"held out": x.error, "training": x.training_error}, x.fit.joint_names, x.torque_units
    ),
    "parameters": lambda x: parameters_of(x.fit),
    "plot_residual": plot_residual,
}
