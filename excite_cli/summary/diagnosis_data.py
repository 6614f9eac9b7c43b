"""A diagnosis as plain values, for `--json`."""

from dataclasses import asdict
from typing import Any

from excite_cli.diagnosis.answer_words import answer_in_words, shares
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, HeldOutEnds, NamedEffect
from excite_cli.diagnosis.words import approximation_in_words, no_gain_in_words


def _record(record: EffectRecord) -> dict[str, Any]:
    found: dict[str, Any] = {"kind": record.kind, "joints": list(record.joints)}
    if record.shape:
        found["shape"] = dict(record.shape)
    if record.runs:
        found["runs"] = list(record.runs)
    if record.covariate:
        found["covariate"] = record.covariate
    return found


def _named(named: NamedEffect, runs: list[str]) -> dict[str, Any]:
    return {
        "kind": named.effect.kind,
        "joints": list(named.effect.joints),
        **({"link": named.effect.link} if named.effect.link else {}),
        **({"covariate": named.effect.covariate} if named.effect.covariate else {}),
        "parameters": {name: asdict(value) for name, value in named.parameters.items()},
        "p_value": named.p_value,
        "share_of_residual": named.share_of_residual,
        "gain": named.gain,
        "alias_set": [_record(alias) for alias in named.aliases],
        "runs": list(named.effect.runs) or runs,
        "verdict": named.verdict,
        "removes": {joint: asdict(each) for joint, each in named.removes.items()},
        "error_reduction": dict(named.parts),
    }


def _ends(part: HeldOutEnds) -> dict[str, Any]:
    return {
        "runs": list(part.runs),
        "effects": [_record(effect) for effect in part.effects],
        "before": part.before.as_data(),
        "after": part.after.as_data(),
    }


def _model(found: Diagnosis) -> dict[str, Any]:
    """All numbers of the model that predicts: inertias, and every effect, declared or found."""
    named = dict(zip(found.inertia_names, map(float, found.phi), strict=False))
    records = [*found.declared, *(each.effect for each in found.effects)]
    return {
        "inertias": named,
        "effects": [{**_record(each), "values": list(each.values)} for each in records],
    }


def diagnosis_data(found: Diagnosis, experiment: dict[str, Any]) -> dict[str, Any]:
    """The answer for `--json`."""
    runs = [str(name) for name in found.processing.get("runs", [])]
    return {
        "good": found.good,
        "reason": no_gain_in_words(found),
        "answer": answer_in_words(found),
        "shares": shares(found),
        "declared_effects": [_record(record) for record in found.declared],
        "effects": [_named(each, runs) for each in found.named],
        "approximations": [
            {**_named(each, runs), "stands_for": approximation_in_words(each.approximates)}
            for each in found.effects
            if each.approximates
        ],
        "joint_aliases": [
            {
                **{name: [_record(one) for one in side] for name, side in vars(each).items()},
                "same_torque": each.same_torque,
            }
            for each in found.joint_aliases
        ],
        "friction_lines": [asdict(each) for each in found.friction_lines],
        "model": _model(found),
        "absorbed": [
            {"kind": a.kind, "joints": list(a.joints), "by": list(a.by), "left": a.left}
            for a in found.absorbed
        ],
        "unexplained": [
            {
                "joint": each.joint,
                "depends_on": [covariate.code for covariate in each.depends_on],
                "share_of_residual": each.predictable,
            }
            for each in found.unexplained
        ],
        "excess_residuals": [
            {**asdict(each), "depends_on": [covariate.code for covariate in each.depends_on]}
            for each in found.excess_residuals
        ],
        "error": {
            "held_out_run": found.held_out_run,
            "before": found.before.as_data(),
            "textbook": found.textbook.error.as_data() if found.textbook else None,
            "after": found.after.as_data(),
            "parts": [_ends(part) for part in found.parts],
            "baseline": "untouched" if found.inertia_parts else "before",
            "inertias_error_reduction": dict(found.inertia_parts),
            "untouched": found.untouched.as_data() if found.untouched else None,
            "training": found.trained.as_data() if found.trained else None,
            "samples": found.after.samples,
        },
        "textbook": [_record(each) for each in found.textbook.effects] if found.textbook else None,
        "assumed": [asdict(each) for each in found.assumed],
        "noise_floor": found.noise_floor,
        "next_experiment": experiment,
        "findings": [asdict(finding) for finding in found.findings],
        "processing": found.processing,
        "rounds": [asdict(each) for each in found.rounds],
        "seconds": found.seconds,
    }
