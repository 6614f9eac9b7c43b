"""A diagnosis for people (tables and sentences) and for scripts (JSON)."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from excite_cli.diagnosis.change_words import changes_in_words
from excite_cli.diagnosis.next_motion import next_experiment
from excite_cli.diagnosis.records import (
    Diagnosis,
    EffectRecord,
    JointAlias,
    NamedEffect,
    Round,
    SealedEnds,
)
from excite_cli.diagnosis.verdict import SealedVerdict, Verdict
from excite_cli.diagnosis.words import (
    SMALL_SHARE,
    approximation_in_words,
    assumption_in_words,
    counted,
    covariate_in_symbols,
    ends_in_words,
    is_small,
    no_gain_in_words,
    other_name_of,
    p_in_words,
    place_in_words,
    rests_in_words,
    sealed_in_words,
    untouched_in_words,
    value_in_words,
)
from excite_cli.identification.fit_words import above_the_floor
from excite_cli.shown.answer import Answer
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts, Table
from excite_cli.summary.cells import figure, percent
from excite_cli.summary.noise_floor import floor_cells, floor_columns
from excite_cli.summary.written import files_in_words


def diagnosis_answer(
    found: Diagnosis,
    config: str,
    written: Mapping[str, str | Path | None],
    verbose: bool = False,
) -> Answer:
    """What `excite diagnose` answers; `written` are the files that were requested, by kind.

    With `verbose` also how the data were processed, every round's suspects, and small effects.
    """
    files = {kind: str(path) for kind, path in written.items() if path is not None}
    experiment = next_experiment(found, config, files.get("diagnosis", "DIAGNOSIS.h5"))
    parts = diagnosis_parts(found, verbose)
    if not verbose:
        rounds = counted(len(found.rounds), "round")
        parts.append(f"({rounds} of tests; --verbose shows the suspects of each, and why not.)")
    parts += [_next(experiment), *files_in_words(files)]
    return Answer(tuple(parts), {**_data(found, experiment), "output": files}, found.good)


def diagnosis_parts(found: Diagnosis, verbose: bool = False) -> Parts:
    """What is missing, absorbed or unexplained, before and after."""
    parts: Parts = [] if found.good else [no_gain_in_words(found)]
    if verbose:
        parts.append(_data_in_words(found))
        parts += [_round_table(found, each) for each in found.rounds]
    if found.named:
        parts += _effects(found, verbose)
    if found.approximations:
        parts.append(_approximation_table(found))
    parts += changes_in_words(found)
    if not found.effects:
        whole = "Nothing is missing: no" if found.complete else "No"
        parts.append(f"{whole} effect of the catalogue passes.")
    parts += _absorbed(found) + _unexplained(found)
    parts += [text for texts in rests_in_words(found) for text in texts]
    parts.append(_error_table(found, verbose))
    above = above_the_floor(found.after, found.noise_floor)
    parts += [above] if above else []
    parts += [ends_in_words(part) for part in found.parts]
    parts += [f"Assumed: {assumption_in_words(each)}" for each in found.assumed]
    parts.append(_verdict(found))
    return parts


def _data_in_words(found: Diagnosis) -> str:
    p = found.processing
    cut = p.get("position_cutoff")
    standing = max(p.get("standstill_share", [0.0]), default=0.0)
    return (
        f"{p['samples']} samples at {p['rate']:.3g} Hz; positions cut off at "
        f"{'no frequency' if cut is None else f'{cut:.3g} Hz'}; joints stand still in up to "
        f"{standing:.0%} of the samples, which are left out. {p['candidates']} candidates; sealed: "
        f"{found.sealed_run}. Placebos exceed χ² by {p['inflation']:.2f}; tests allow for it."
    )


def _round_table(found: Diagnosis, each: Round) -> Table:
    worst = max(each.residual, key=lambda joint: each.residual[joint])
    rows = tuple(
        (
            suspect.effect.kind,
            place_in_words(suspect.effect, len(found.joint_names)),
            p_in_words(suspect.p_value, suspect.least_p),
            f"{suspect.share_of_residual:.1%}",
            f"{suspect.gain:.1%}",
            f"{suspect.verdict}: {suspect.why}" if suspect.why else suspect.verdict,
        )
        for suspect in each.suspects
    )
    return Table(
        f"Round {each.index}: residual up to {each.residual[worst]:.3g} ({worst}); {each.verdict}",
        ("suspect", "where", "p", "share", "gain", "verdict"),
        rows,
        words=("suspect", "where", "verdict"),
        bold=tuple(k for k, each in enumerate(each.suspects) if each.verdict is Verdict.ACCEPTED),
    )


def _effects(found: Diagnosis, verbose: bool) -> Parts:
    """The named effects, small ones in one line, and what each cannot be told from."""
    everything = len(found.joint_names)
    ranked = sorted(found.named, key=lambda each: -each.share_of_residual)
    small = [each for each in ranked if is_small(each)]
    if verbose or len(small) < 2:  # a line about one is no shorter than the one
        small = []
    shown = [each for each in ranked if not any(each is other for other in small)]
    parts: Parts = [_effect_table(shown, everything, verbose)]
    if small:
        listed = ", ".join(
            _what(each.effect, everything)
            + f" ({each.verdict})" * (each.verdict is SealedVerdict.NOT_CONFIRMED)
            for each in small
        )
        parts.append(
            f"and {len(small)} small ones (each below {SMALL_SHARE:.1%}): {listed} "
            "(--verbose: sizes)"
        )
    parts += [text for named in found.named for text in _other_names(named, everything)]
    return [*parts, *(_joint_alias(each, everything) for each in found.joint_aliases)]


def _effect_table(shown: Sequence[NamedEffect], everything: int, verbose: bool) -> Table:
    rows = tuple(
        (
            named.effect.kind,
            place_in_words(named.effect, everything),
            "\n".join(value_in_words(name, value) for name, value in named.parameters.items()),
            *([p_in_words(named.p_value, named.least_p)] if verbose else []),
            f"{named.share_of_residual:.2%}",
            sealed_in_words(named),
        )
        for named in shown
    )
    return Table(
        "What the declared model lacks (share: of the residual; sealed: change of error)",
        ("effect", "where", "size", *(["p"] if verbose else []), "share", "sealed"),
        rows,
        left=("effect",),
        words=("where", "size", "sealed"),
    )


def _other_names(named: NamedEffect, everything: int) -> list[str]:
    """What it cannot be told from: by these data, and by any."""
    what, found = _what(named.effect, everything), []
    if named.aliases:
        others = ", ".join(_what(alias, everything) for alias in named.aliases)
        found.append(f"{what} cannot be told from: {others}")
    if same := other_name_of(named.effect.kind):
        found.append(f"{what} is the same torque as {' and '.join(same)}")
    return found


def _joint_alias(alias: JointAlias, everything: int) -> str:
    named, others = (
        " with ".join(_what(one, everything) for one in side)
        for side in (alias.named, alias.others)
    )
    return f"{named} cannot be told from: {others}"


def _what(record: EffectRecord, everything: int) -> str:
    return f"{record.kind} on {place_in_words(record, everything)}"


def _approximation_table(found: Diagnosis) -> Table:
    rows = tuple(
        (
            each.effect.kind,
            place_in_words(each.effect, len(found.joint_names)),
            "\n".join(value_in_words(name, value) for name, value in each.parameters.items()),
            f"{each.share_of_residual:.2%}",
            sealed_in_words(each),
            approximation_in_words(each.approximates) if each.approximates else "",
        )
        for each in found.approximations
    )
    return Table(
        "Approximations: they come near something else that is there",
        ("effect", "where", "size", "share", "sealed", "stands for"),
        rows,
        left=("effect",),
        words=("where", "size", "sealed", "stands for"),
    )


def _absorbed(found: Diagnosis) -> Parts:
    if not found.absorbed:
        return []
    rows = tuple(
        (
            each.kind,
            ", ".join(each.joints) if len(each.joints) < 3 else "all joints",
            ", ".join(each.by),
        )
        for each in found.absorbed
    )
    table = Table(
        "Not testable: these would show as other values of parameters",
        ("effect", "where", "absorbed by"),
        rows,
        left=("effect", "where"),
        words=("absorbed by",),
    )
    return [table]


def _unexplained(found: Diagnosis) -> Parts:
    return [
        f"Unexplained: the residual of {each.joint} still depends on "
        f"{', '.join(map(covariate_in_symbols, each.depends_on))} "
        f"({each.share_of_residual:.1%} of it); no effect of the catalogue has this form."
        for each in found.unexplained
    ]


def _error_table(found: Diagnosis, verbose: bool) -> Table:
    """Errors where the joints move; with `verbose` over all samples, too."""
    errors = (found.before, found.after)
    # Files of earlier versions do not say whether joints slide.
    units = found.traces.torque_units if found.traces else ("",) * len(found.joint_names)
    rows = [
        (
            joint,
            *(percent(error.relative_moving[joint]) for error in errors),
            *(percent(error.relative[joint]) for error in errors if verbose),
            *(figure(error.rms[joint]) for error in errors),
            unit,
            *floor_cells(found.noise_floor, joint),
        )
        for joint, unit in zip(found.joint_names, units, strict=True)
    ]
    more = ("all, before", "all, after") if verbose else ()
    floor = floor_columns(found.noise_floor)
    mean = (
        "mean",
        *(f"{error.mean_relative_moving:.2%}" for error in errors),
        *(f"{error.mean_relative:.2%}" for error in errors if verbose),
        *[""] * (3 + len(floor)),
    )
    return Table(
        f"Error of the torque on data never used ({found.sealed_run}), where joints move",
        ("joint", "before", "after", *more, "RMS before", "RMS after", "unit", *floor),
        (*rows, mean),
        left=("joint", "unit"),
        bold=(len(rows),),
        parted=(len(rows),),
    )


def _verdict(found: Diagnosis) -> str:
    low, high = found.after.interval
    return (
        f"{counted(len(found.named), 'effect')}"
        + (f", {counted(len(found.approximations), 'approximation')}" * bool(found.approximations))
        + "; mean error "
        f"{found.before.mean_relative_moving:.2%} → "
        f"{found.after.mean_relative_moving:.2%} where joints move (over all samples "
        f"{found.after.mean_relative:.2%}, 95 % interval {low:.2%} to {high:.2%}). "
        f"{untouched_in_words(found)} {found.seconds:.1f} s."
    )


def _next(experiment: dict[str, Any]) -> str:
    if experiment["purpose"] == "separate":
        count = len(experiment["pairs"])
        return (
            f"Next motion: tell apart {count} pair{'s' if count > 1 else ''} of effects:  "
            f"{experiment['command']}"
        )
    return f"Next motion: excite the extended model:  {experiment['command']}"


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
    }


def _ends(part: SealedEnds) -> dict[str, Any]:
    return {
        "runs": list(part.runs),
        "effects": [_record(effect) for effect in part.effects],
        "before": part.before.as_data(),
        "after": part.after.as_data(),
    }


def _data(found: Diagnosis, experiment: dict[str, Any]) -> dict[str, Any]:
    """The answer for `--json`."""
    runs = [str(name) for name in found.processing.get("runs", [])]
    return {
        "good": found.good,
        "reason": no_gain_in_words(found),
        "declared_effects": [_record(record) for record in found.declared],
        "effects": [_named(each, runs) for each in found.named],
        "approximations": [
            {**_named(each, runs), "stands_for": approximation_in_words(each.approximates)}
            for each in found.effects
            if each.approximates
        ],
        "joint_aliases": [
            {name: [_record(one) for one in side] for name, side in vars(each).items()}
            for each in found.joint_aliases
        ],
        "absorbed": [
            {"kind": a.kind, "joints": list(a.joints), "by": list(a.by), "left": a.left}
            for a in found.absorbed
        ],
        "unexplained": [
            {**asdict(each), "depends_on": [covariate.code for covariate in each.depends_on]}
            for each in found.unexplained
        ],
        "large_rests": [
            {**asdict(each), "depends_on": [covariate.code for covariate in each.depends_on]}
            for each in found.large_rests
        ],
        "error": {
            "sealed_run": found.sealed_run,
            "before": found.before.as_data(),
            "after": found.after.as_data(),
            "parts": [_ends(part) for part in found.parts],
            "untouched": found.untouched.as_data() if found.untouched else None,
            "samples": found.after.samples,
        },
        "assumed": [asdict(each) for each in found.assumed],
        "noise_floor": found.noise_floor,
        "next_experiment": experiment,
        "findings": [asdict(finding) for finding in found.findings],
        "processing": found.processing,
        "rounds": [asdict(each) for each in found.rounds],
        "seconds": found.seconds,
    }


def _in_words(found: Diagnosis) -> str:
    """What was found, and the errors before and after."""
    everything = len(found.joint_names)
    effects = ", ".join(_what(each.effect, everything) for each in found.named)
    before, after = found.before.mean_relative_moving, found.after.mean_relative_moving
    none = "nothing is missing" if found.complete else "no name for what is left"
    return f"{effects or none}; mean error {before:.2%} → {after:.2%}"


def _named_in_words(named: NamedEffect) -> str:
    """`coulomb_friction on elbow: coulomb 2.998 ± 0.0012 N·m`; joints are named, however many."""
    sizes = (value_in_words(name, value) for name, value in named.parameters.items())
    return f"{_what(named.effect, 0)}: {', '.join(sizes)}"


show(Diagnosis, _in_words, diagnosis_parts)
show(
    NamedEffect,
    _named_in_words,
    lambda named: [_effect_table([named], 0, verbose=True), *_other_names(named, 0)],
)
