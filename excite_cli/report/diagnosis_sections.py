"""What a page says about a diagnosis, in the order in which a reader asks."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from excite_cli.diagnosis.next_motion import next_experiment
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, Round
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.words import (
    counted,
    ends_in_words,
    no_gain_in_words,
    p_in_words,
    place_in_words,
    title_of,
    untouched_in_words,
)
from excite_cli.report.dependence_section import dependence_section
from excite_cli.report.diagnosis_found_section import found_section
from excite_cli.report.effect_section import effect_section
from excite_cli.report.page import Block, Charts, Fold, KeyFigure, PageSection, TableBlock, Text
from excite_cli.report.residual_error_section import by_joint, error_blocks
from excite_cli.report.residual_findings import findings_blocks, processing_table
from excite_cli.report.residual_section import residuals_in_time
from excite_cli.report.robot_chart import robot_chart

# How the effects were found: round by round the suspects, and why the others were refused.

_OPEN_ROUNDS = 3


def suspect_section(found: Diagnosis) -> PageSection:
    """A table for every round; all but a few are folded."""
    tables = [_round(found, each) for each in found.rounds]
    first, later = tables[:_OPEN_ROUNDS], tables[_OPEN_ROUNDS:]
    blocks: tuple[Block, ...] = tuple(first)
    if later:
        last = len(tables)
        words = f"round {last}" if len(later) == 1 else f"rounds {_OPEN_ROUNDS + 1} to {last}"
        blocks = (*first, Fold(f"The other {counted(len(later), 'round')}: {words}", tuple(later)))
    lead = (
        "Every round judges all candidates beside what was found before and takes the one that "
        "saves most. Shown are the strongest candidates and the verdict on each: the p-value is "
        "corrected for the number of tests; the share is of the residual at that point; the gain "
        "is by how much the error on runs left out falls. One that is refused now may be accepted "
        "in a later round."
    )
    return PageSection("diagnosis-candidates", "Rejected candidates, with reasons", blocks, lead)


def _round(found: Diagnosis, each: Round) -> TableBlock:
    joints = len(found.joint_names)
    worst = max(each.residual, key=lambda joint: each.residual[joint])
    rows = tuple(
        (
            title_of(suspect.effect.kind),
            place_in_words(suspect.effect, joints),
            p_in_words(suspect.p_value, suspect.least_p),
            f"{suspect.share_of_residual:.1%}",
            f"{suspect.gain:.1%}",
            f"{suspect.verdict}: {suspect.why}" if suspect.why else suspect.verdict,
        )
        for suspect in each.suspects
    )
    taken = {k for k, suspect in enumerate(each.suspects) if suspect.verdict is Verdict.ACCEPTED}
    return TableBlock(
        ("candidate", "where", "p", "share", "gain", "verdict"),
        rows,
        title=f"Round {each.index}: RMS residual up to {each.residual[worst]:.3g} ({worst})",
        right=frozenset({2, 3, 4}),
        strong=frozenset(taken),
    )


def diagnosis_figures(diagnosis: Diagnosis) -> tuple[KeyFigure, ...]:
    """What sums a diagnosis up."""
    low, high = diagnosis.after.interval
    before, after = diagnosis.before, diagnosis.after
    names = [title_of(each.effect.kind) for each in diagnosis.named]
    kinds = ", ".join(dict.fromkeys(names[:3])) + (" …" if len(set(names)) > 3 else "")
    open_questions = sum(bool(each.aliases) for each in diagnosis.effects)
    bad = KeyFigure("verdict", "the held-out error did not fall", no_gain_in_words(diagnosis))
    return (
        *([] if diagnosis.good else [bad]),
        KeyFigure(
            "error on held-out data, moving",
            f"{before.mean_relative_moving:.2%} → {after.mean_relative_moving:.2%}",
            f"all samples {after.mean_relative:.2%}, 95% interval {low:.2%} to {high:.2%}",
        ),
        KeyFigure("effects found", str(len(diagnosis.named)), kinds or _none(diagnosis)),
        KeyFigure(
            "not distinguished",
            str(open_questions),
            "effects with indistinguishable alternatives"
            if open_questions
            else "every effect is unique",
        ),
        KeyFigure(
            "unexplained",
            counted(len(diagnosis.joints_with_residual), "joint"),
            ", ".join(diagnosis.joints_with_residual) or "the residual behaves like noise",
        ),
        _warnings(diagnosis),
    )


def _warnings(diagnosis: Diagnosis) -> KeyFigure:
    """How many warnings there are about the data, and of what kinds; their texts are below."""
    warned = [each for each in diagnosis.findings if each.severity == "warning"]
    kinds = dict.fromkeys(each.kind.replace("_", " ") for each in warned)
    remark = f"{', '.join(kinds)}: see Data and choices" if kinds else "taken as recorded"
    return KeyFigure("about the data", counted(len(warned), "warning"), remark)


def _none(diagnosis: Diagnosis) -> str:
    return "nothing is missing" if diagnosis.complete else "unexplained residual"


def diagnosis_sections(diagnosis: Diagnosis) -> tuple[PageSection, ...]:
    """Found, errors, residual in time, evidence, rest, suspects, data, and what to do next."""
    evidence = effect_section(diagnosis)
    return (
        found_section(diagnosis),
        _errors(diagnosis),
        _in_time(diagnosis),
        *([evidence] if evidence is not None else []),
        dependence_section(diagnosis),
        _next(diagnosis),
        suspect_section(diagnosis),
        _data(diagnosis),
    )


def torque_units(diagnosis: Diagnosis) -> tuple[str, ...]:
    """N·m of joints that turn, N of those that slide; N·m where an earlier file has neither."""
    if diagnosis.traces is None:
        return ("N·m",) * len(diagnosis.joint_names)
    return diagnosis.traces.torque_units


def _errors(diagnosis: Diagnosis) -> PageSection:
    low, high = diagnosis.after.interval
    blocks = error_blocks(
        ("before", "after"),
        diagnosis.before,
        diagnosis.after,
        by_joint(diagnosis.joint_names, torque_units(diagnosis)),
        diagnosis.noise_floor,
        "On held-out data; raw: after, on the torque as recorded, without any filter.",
    )
    if diagnosis.skeleton is not None:
        what = "Residual relative error where the joint moves, on held-out data"
        robot = robot_chart(
            "Where the residual is", diagnosis.skeleton, diagnosis.joint_names,
            diagnosis.after.relative_moving, what,
        )  # fmt: skip
        (charts, *others) = blocks
        assert isinstance(charts, Charts)
        blocks = (replace(charts, charts=(robot, *charts.charts)), *others)
    blocks = (*blocks, *(Text(ends_in_words(part)) for part in diagnosis.parts))
    lead = (
        f"On {diagnosis.held_out_run}, which took no part in choosing or fitting. Before: the "
        "declared model, fitted to the same training data; after: with the effects that were "
        f"found. Mean over all samples after: {diagnosis.after.mean_relative:.2%}, 95% interval "
        f"{low:.2%} to {high:.2%}. {untouched_in_words(diagnosis)}"
    )
    return PageSection("diagnosis-errors", "Error before and after", blocks, lead)


def _in_time(diagnosis: Diagnosis) -> PageSection:
    training = diagnosis.traces.runs if diagnosis.traces is not None else ()
    traces = (*diagnosis.held_out_traces, *training)
    lead = (
        ""
        if not traces
        else (
            "Filtered torque, as used in the fit. Above: measured torque and prediction of the "
            "model with all effects; below: residuals of this and of the declared model. Shaded: "
            "held out."
        )
    )
    blocks = residuals_in_time(traces, diagnosis.joint_names, torque_units(diagnosis))
    return PageSection("diagnosis-time", "Residual in time", blocks, lead)


def _next(diagnosis: Diagnosis) -> PageSection:
    experiment = next_experiment(diagnosis)
    pairs = experiment["pairs"]
    if not pairs:
        lead = (
            "No effects are left to distinguish: the next motion excites the model with the "
            "effects that were found."
        )
        return PageSection("diagnosis-next", "Next motion", (_command(experiment),), lead)
    rows = tuple((_named(pair["effect"]), _named(pair["alias"])) for pair in pairs)
    lead = (
        f"{counted(len(rows), 'pair')} of effects fit these data as well as each other. The next "
        "motion is planned to distinguish them."
    )
    table = TableBlock(("found", "indistinguishable from"), rows)
    return PageSection("diagnosis-next", "Next motion", (table, _command(experiment)), lead)


def _command(experiment: dict[str, Any]) -> Text:
    return Text(experiment["command"], "code")


def _named(data: dict[str, Any]) -> str:
    return f"{title_of(data['kind'])} on {', '.join(data['joints'])}"


def _runs(diagnosis: Diagnosis) -> list[TableBlock]:
    """Every run, what it was for, and what is there in it and not in all others."""
    names = [str(each) for each in diagnosis.processing.get("runs", ())]
    if len(names) < 2:
        return []
    found = [each.effect for each in diagnosis.effects]
    every = (*diagnosis.declared, *found)
    uses = (*((name, "training") for name in names), (diagnosis.held_out_run, "held-out"))
    rows = tuple(
        (name, use, ", ".join(_own(each) for each in every if _within(name, each.runs)) or "–")
        for name, use in uses
    )
    note = (
        "Effects of single runs that are found are never looked for in the held-out one."
        if any(each.runs for each in found)
        else ""
    )
    return [TableBlock(("run", "used as", "in it, not in all"), rows, title="Runs", note=note)]


def _within(name: str, runs: Sequence[str]) -> bool:
    """Whether a run, or a part or the whole of it, is among the runs."""
    return any(
        name == run or name.startswith(f"{run}/") or run.startswith(f"{name}/") for run in runs
    )


def _own(record: EffectRecord) -> str:
    return f"{title_of(record.kind)} of {', '.join(record.joints)}"


def _data(diagnosis: Diagnosis) -> PageSection:
    blocks: list[Block] = [*findings_blocks(diagnosis.findings), *_runs(diagnosis)]
    blocks.append(processing_table(diagnosis.processing, diagnosis.joint_names))
    blocks.append(Fold("Configuration that was diagnosed", (Text(diagnosis.config, "code"),)))
    versions = ", ".join(f"{name} {version}" for name, version in diagnosis.versions.items())
    blocks.append(Text(f"{diagnosis.seconds:.1f} s. {versions}"))
    lead = (
        "To go on with the extended model, `excite diagnose … --apply NEW.yaml` writes this "
        "configuration with the effects that were found."
    )
    return PageSection("diagnosis-data", "Data and choices", tuple(blocks), lead)
