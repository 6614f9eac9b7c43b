"""A diagnosis for people (tables and sentences) and for scripts (JSON)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from excite_cli.diagnosis.answer_words import answer_in_words
from excite_cli.diagnosis.next_motion import next_command, next_experiment
from excite_cli.diagnosis.records import (
    Diagnosis,
    NamedEffect,
    Round,
)
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.words import (
    assumption_in_words,
    changes_in_words,
    counted,
    ends_in_words,
    joints_in_words,
    p_in_words,
    place_in_words,
    rests_in_words,
    settled_in_words,
    value_in_words,
)
from excite_cli.identification.fit_words import above_the_floor
from excite_cli.shown.answer import Answer, Command, Parts, Table, as_word
from excite_cli.shown.record import show
from excite_cli.summary.cells import files_in_words
from excite_cli.summary.diagnosis_data import diagnosis_data
from excite_cli.summary.error_by_joint import error_tables
from excite_cli.summary.named_effects import (
    approximation_parts,
    effect_parts,
    effect_table,
    friction_table,
    other_names,
    what_and_where,
)


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
    place = files.get("diagnosis", "DIAGNOSIS.h5")
    experiment = next_experiment(found, config, place)
    parts = diagnosis_parts(found, verbose)
    if not verbose:
        rounds = counted(len(found.rounds), "round")
        parts.append(f"({rounds} of tests; --verbose shows the rejected candidates, with reasons.)")
    parts += [*files_in_words(files), *_next(found, experiment, config, files.get("diagnosis"))]
    return Answer(tuple(parts), {**diagnosis_data(found, experiment), "output": files}, found.good)


def diagnosis_parts(found: Diagnosis, verbose: bool = False) -> Parts:
    """What is missing, absorbed or unexplained, before and after."""
    parts: Parts = [answer_in_words(found)]
    if verbose:
        parts.append(_data_in_words(found))
        parts += [_round_table(found, each) for each in found.rounds]
    if found.effects:
        parts += effect_parts(found, verbose)
    parts += approximation_parts(found, verbose)
    parts += [friction_table(found.friction_lines)] if verbose and _has_curves(found) else []
    parts += changes_in_words(found)
    parts += absorbed_parts(found)
    parts += [text for texts in rests_in_words(found) for text in texts]
    parts += error_tables(found, verbose)
    above = above_the_floor(found.after, found.noise_floor)
    parts += [above] if above else []
    parts += [ends_in_words(part) for part in found.parts]
    parts += [f"Assumed: {assumption_in_words(each)}" for each in found.assumed]
    parts.append(_verdict(found))
    return parts


def _has_curves(found: Diagnosis) -> bool:
    return any(line.curved for line in found.friction_lines)


def _data_in_words(found: Diagnosis) -> str:
    p = found.processing
    cut = p.get("position_cutoff")
    standing = max(p.get("standstill_share", [0.0]), default=0.0)
    return (
        f"{p['samples']} training samples at {p['rate']:.3g} Hz; positions "
        f"{'not filtered' if cut is None else f'low-passed at {cut:.3g} Hz'}; standstill (up to "
        f"{standing:.0%} of a joint's samples) excluded. {p['candidates']} candidates; held out: "
        f"{found.held_out_run}. Test statistics are divided by {p['inflation']:.2f}, by which "
        "time-shifted columns exceed χ²."
    )


def _round_table(found: Diagnosis, each: Round) -> Table:
    worst = max(each.residual, key=lambda joint: each.residual[joint])
    units = found.traces.torque_units if found.traces else ("",) * len(found.joint_names)
    unit = dict(zip(found.joint_names, units, strict=True)).get(worst, "")
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
        f"Round {each.index}: largest residual {each.residual[worst]:.3g} {unit} RMS ({worst}); "
        f"{each.verdict} (p: of it alone; sets are judged together)",
        ("candidate", "where", "p", "of residual", "gain on data left out", "verdict"),
        rows,
        words=("candidate", "where", "verdict"),
        bold=tuple(k for k, each in enumerate(each.suspects) if each.verdict is Verdict.ACCEPTED),
    )


def absorbed_parts(found: Diagnosis) -> Parts:
    """Candidates that would show as other values of parameters: a table, if there are any."""
    if not found.absorbed:
        return []
    rows = tuple(
        (
            each.kind,
            joints_in_words(each.joints, len(found.joint_names)),
            ", ".join(each.by),
        )
        for each in found.absorbed
    )
    table = Table(
        "Not identifiable: confounded with parameters of the model",
        ("effect", "where", "confounded with"),
        rows,
        left=("effect", "where"),
        words=("confounded with",),
    )
    return [table, *settled_in_words(found)]


def _verdict(found: Diagnosis) -> str:
    low, high = found.after.interval
    return (
        f"{counted(len(found.named), 'effect')}"
        + (f", {counted(len(found.approximations), 'surrogate term')}" * bool(found.approximations))
        + "; mean held-out error where joints move "
        f"{found.before.mean_relative_moving:.2%} → {found.after.mean_relative_moving:.2%}; over "
        f"all samples {found.after.mean_relative:.2%} (its 95% interval {low:.2%} to {high:.2%}). "
        f"{found.seconds:.1f} s."
    )


def _next(found: Diagnosis, experiment: dict[str, Any], config: str, file: str | None) -> Parts:
    """What to do next, with the `file` of the diagnosis: commands that can be typed."""
    if file is None:
        return ["Next: repeat with -o DIAGNOSIS.h5, for a report and for the next motion."]
    if found.complete:
        return ["Next, with other data:", Command(("excite", "score", as_word(file), "DATA.h5"))]
    purpose = "excite the model with what was found"
    if experiment["purpose"] == "separate":
        purpose = f"distinguish {counted(len(experiment['pairs']), 'pair')} of effects"
    return [f"Next: plan a motion, to {purpose}:", next_command(config, file)]


def _in_words(found: Diagnosis) -> str:
    """What was found, and the errors before and after."""
    everything = len(found.joint_names)
    effects = ", ".join(what_and_where(each.effect, everything) for each in found.named)
    before, after = found.before.mean_relative_moving, found.after.mean_relative_moving
    none = "nothing is missing" if found.complete else "unexplained residual"
    return f"{effects or none}; mean error {before:.2%} → {after:.2%}"


def _named_in_words(named: NamedEffect) -> str:
    """`coulomb_friction on elbow: coulomb 2.998 ± 0.0012 N·m`; joints are named, however many."""
    sizes = (value_in_words(name, value) for name, value in named.parameters.items())
    return f"{what_and_where(named.effect, 0)}: {', '.join(sizes)}"


show(Diagnosis, _in_words, diagnosis_parts)
show(
    NamedEffect,
    _named_in_words,
    lambda named: [effect_table([named], 0, verbose=True), *other_names(named, 0)],
)
