"""Rows of numbers of the records that have them: what `record.table(…)` makes a DataFrame of."""

from collections.abc import Iterable, Iterator, Mapping
from math import nan
from typing import Any

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.regressor import standard_parameter_unit
from excite_cli.effects.base import Value
from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.parameter import unit_of_slider
from excite_cli.identification.fit import Fit
from excite_cli.identification.identify import Identification
from excite_cli.identification.stored_model import StoredFit
from excite_cli.shown.answer import Tables
from excite_cli.summary.error_by_joint import errors_by_model, measured_joints

Rows = Iterable[Mapping[str, Any]]


def _found_effects(found: Diagnosis) -> Rows:
    """A row for every parameter of every effect that was found."""
    for named in found.effects:
        record = named.effect
        for name, value in named.parameters.items():
            yield {
                **_value(record.kind, record.joints, name, value),
                "runs": ", ".join(record.runs),
                "covariate": record.covariate,
                "p_value": named.p_value,
                "share_of_residual": named.share_of_residual,
                "gain": named.gain,
                "error_reduction": named.error_reduction,
                "verdict": str(named.verdict or ""),
                "approximation": named.approximates is not None,
            }


def _value(kind: str, joints: Iterable[str], name: str, value: Value) -> dict[str, Any]:
    return {
        "effect": kind,
        "joints": ", ".join(joints),
        "parameter": name,
        "value": value.value,
        "std": value.std,
        "unit": value.unit,
    }


def _errors_of_models(found: Diagnosis) -> Rows:
    """A row for every joint whose torque was measured; shares of its RMS where it moves."""
    models = {key.lower().replace(" ", "_"): e for key, e in errors_by_model(found).items()}
    for joint, unit in measured_joints(found):
        yield {
            "joint": joint,
            **{f"error_{name}": each.relative_moving[joint] for name, each in models.items()},
            **{
                f"rms_{name}": (each.rms_moving or each.rms)[joint] for name, each in models.items()
            },
            "noise_floor": (found.noise_floor or {}).get(joint, nan),
            "unit": unit,
        }


def _whole_model(found: Diagnosis) -> Iterator[dict[str, Any]]:
    """Inertias φ, then the effects; deviations of effects that were found."""
    for k, (name, value) in enumerate(zip(found.inertia_names, found.phi, strict=False)):
        unit = standard_parameter_unit(k)
        yield {"parameter": name, "value": float(value), "std": nan, "unit": unit}
    sliding = {j for j, u in zip(found.joint_names, found.torque_units, strict=True) if u == "N"}
    for record in found.declared:
        for parameter, value in zip(kind_named(record.kind).parameters, record.values, strict=True):
            unit = parameter.unit
            told = unit_of_slider(unit) if sliding.issuperset(record.joints) else unit
            name = f"{record.kind}.{parameter.name}[{','.join(record.joints)}]"
            yield {"parameter": name, "value": value, "std": nan, "unit": told}
    for row in _found_effects(found):
        name = f"{row['effect']}.{row['parameter']}[{row['joints'].replace(', ', ',')}]"
        yield {"parameter": name, **{key: row[key] for key in ("value", "std", "unit")}}


def _parameters(fit: Fit) -> Rows:
    columns = (fit.values, fit.std, fit.units, fit.relative_std, fit.identifiable, fit.essential)
    keys = ("value", "std", "unit", "relative_std", "identifiable", "essential")
    for k, name in enumerate(fit.names):
        own = (column[k] for column in columns)
        yield {"parameter": name, **dict(zip(keys, own, strict=True))}


def _effects(fit: Fit) -> Rows:
    for k, effect in enumerate(fit.effects):
        joints = [fit.joint_names[j] for j in effect.joints]
        for name, value in fit.effect_report(k).items():
            yield _value(effect.kind, joints, name, value)


def _errors(found: Identification | StoredFit) -> Rows:
    error, floor = found.error, found.noise_floor or {}
    for joint, unit in zip(found.fit.joint_names, found.torque_units, strict=True):
        yield {
            "joint": joint,
            "error": error.relative_moving[joint],
            "error_all": error.relative[joint],
            "error_training": found.training_error.relative[joint],
            "rms": error.rms[joint],
            "rms_unfiltered": error.rms_raw[joint],
            "noise_floor": floor.get(joint, nan),
            "unit": unit,
        }


_VALUE = ("effect", "joints", "parameter", "value", "std", "unit")
_EVIDENCE = ("p_value", "share_of_residual", "gain", "error_reduction", "verdict", "approximation")
OF_DIAGNOSIS: Tables[Diagnosis] = {
    "effects": ((*_VALUE, "runs", "covariate", *_EVIDENCE), _found_effects),
    "errors": (("joint",), _errors_of_models),
    "parameters": (("parameter", "value", "std", "unit"), _whole_model),
}
OF_FIT: Tables[Fit] = {
    "effects": (_VALUE, _effects),
    "parameters": (("parameter",), _parameters),
}
OF_IDENTIFICATION: Tables[Identification | StoredFit] = {
    "effects": (_VALUE, lambda found: _effects(found.fit)),
    "errors": (("joint",), _errors),
    "parameters": (("parameter",), lambda found: _parameters(found.fit)),
}
