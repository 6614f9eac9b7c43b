"""A diagnosis as plain values, for `--json`."""

from typing import Any

from excite_cli.diagnosis.answer_words import answer_in_words, shares
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, NamedEffect
from excite_cli.diagnosis.words import approximation_in_words, no_gain_in_words
from excite_cli.fields import data_of, public_data


def _record(record: EffectRecord) -> dict[str, Any]:
    """Where it has a shape, runs or a column, these too."""
    found: dict[str, Any] = data_of(record, "kind", "joints", "shape", "runs", "covariate")
    return {key: value for key, value in found.items() if value or key in ("kind", "joints")}


def _records(records: tuple[EffectRecord, ...]) -> list[dict[str, Any]]:
    return [_record(each) for each in records]


def _named(named: NamedEffect, runs: list[str]) -> dict[str, Any]:
    record = named.effect
    beside = {key: getattr(record, key) for key in ("link", "covariate") if getattr(record, key)}
    evidence = data_of(
        named, "parameters", "p_value", "share_of_residual", "gain", "verdict", "removes"
    )
    return {
        **data_of(record, "kind", "joints"),
        **beside,
        **evidence,
        "alias_set": _records(named.aliases),
        "runs": list(record.runs) or runs,
        "error_reduction": dict(named.parts),
    }


def _model(found: Diagnosis) -> dict[str, Any]:
    """All numbers of the model that predicts: inertias, and every effect, declared or found."""
    named = dict(zip(found.inertia_names, map(float, found.phi), strict=False))
    records = [*found.declared, *(each.effect for each in found.effects)]
    return {
        "inertias": named,
        "effects": [{**_record(each), "values": list(each.values)} for each in records],
    }


def _error(found: Diagnosis) -> dict[str, Any]:
    """Errors of every model, and where the parts of the effects begin."""
    return {
        **data_of(found, "held_out_run", "before", "after", "untouched"),
        "textbook": data_of(found.textbook.error) if found.textbook else None,
        "training": data_of(found.trained),
        "parts": [{**data_of(each), "effects": _records(each.effects)} for each in found.parts],
        "baseline": "untouched" if found.inertia_parts else "before",
        "inertias_error_reduction": dict(found.inertia_parts),
        "samples": found.after.samples,
    }


def diagnosis_data(found: Diagnosis, experiment: dict[str, Any]) -> dict[str, Any]:
    """The answer for `--json`: what follows from the record, and its public fields."""
    runs = [str(name) for name in found.processing.get("runs", [])]
    return {
        "good": found.good,
        "reason": no_gain_in_words(found),
        "answer": answer_in_words(found),
        "shares": shares(found),
        "declared_effects": _records(found.declared),
        "effects": [_named(each, runs) for each in found.named],
        "approximations": [
            {**_named(each, runs), "stands_for": approximation_in_words(each.approximates)}
            for each in found.effects
            if each.approximates
        ],
        "joint_aliases": [
            {
                "named": _records(each.named),
                "others": _records(each.others),
                "same_torque": each.same_torque,
            }
            for each in found.joint_aliases
        ],
        "model": _model(found),
        "unexplained": [
            {"share_of_residual": each.predictable, **data_of(each, "joint", "depends_on")}
            for each in found.unexplained
        ],
        "error": _error(found),
        "textbook": _records(found.textbook.effects) if found.textbook else None,
        "next_experiment": experiment,
        **public_data(found),
    }
