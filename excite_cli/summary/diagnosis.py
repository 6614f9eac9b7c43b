"""The document of a diagnosis, for terminal, notebook and page, and its answer for `--json`."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.diagnosis.answer_words import answer_in_words, shares
from excite_cli.diagnosis.next_motion import next_command, next_experiment
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, NamedEffect, Round
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.words import (
    approximation_in_words,
    counted,
    covariate_in_words,
    no_gain_in_words,
    p_in_words,
    place_in_words,
    rests_in_words,
    title_of,
    value_in_words,
)
from excite_cli.fields import data_of, public_data
from excite_cli.report.residual_chart import (
    IN_TIME,
    dependence_plots,
    noise_by_joint,
    noise_in_words,
    residuals_in_time,
)
from excite_cli.report.validity_chart import validity_section
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import (
    Answer,
    Block,
    Charts,
    Command,
    Detail,
    Fold,
    Parts,
    Section,
    Table,
    Text,
    as_word,
    parts_of,
    show,
)
from excite_cli.summary.cells import files_in_words
from excite_cli.summary.effect_evidence import evidence_section
from excite_cli.summary.error_by_joint import errors_section
from excite_cli.summary.findings import data_blocks
from excite_cli.summary.frames import OF_DIAGNOSIS
from excite_cli.summary.named_effects import (
    effect_table,
    found_section,
    other_names,
    what_and_where,
)
from excite_cli.summary.status import purpose, set_up_is_open

_WORTH = 0.01  # share of the residual from which on a quantity is told
_MOST_QUANTITIES = 18
_OPEN_ROUNDS = 3  # tables of rounds that a page shows without being opened


def diagnosis_answer(
    found: Diagnosis,
    config: str,
    written: Mapping[str, str | Path | None],
    verbose: bool = False,
    data: Sequence[str | Path] = (),
) -> Answer:
    """What `excite diagnose` answers of the files `data`; `written` were requested, by kind.

    With `verbose` also how the data were processed, every round's suspects, and small effects.
    """
    files = {kind: str(path) for kind, path in written.items() if path is not None}
    place = files.get("diagnosis", "DIAGNOSIS.h5")
    experiment = next_experiment(found, config, place)
    parts = diagnosis_parts(found, Detail(verbose))
    if not verbose:
        rounds = counted(len(found.rounds), "round")
        parts.append(f"({rounds} of tests; --verbose shows the rejected candidates, with reasons.)")
    parts += [*files_in_words(files), *_next(found, config, data, files.get("diagnosis"))]
    return Answer(tuple(parts), {**diagnosis_data(found, experiment), "output": files}, found.good)


def diagnosis_parts(found: Diagnosis, detail: Detail = Detail.BRIEF) -> Parts:
    """What is missing, absorbed or unexplained, before and after."""
    sections = diagnosis_sections(found, detail)
    # The search goes first, so that its result is what one sees last.
    order = {"diagnosis-data": -2, "diagnosis-candidates": -1, "diagnosis-errors": 1}
    sections.sort(key=lambda each: order.get(each.anchor, 0))
    return [answer_in_words(found), *parts_of(sections)]


def diagnosis_sections(
    found: Diagnosis, detail: Detail = Detail.PAGE, robot: Robot | None = None
) -> list[Section]:
    """Those that have something to say, in the order of a page, which shows the `robot`."""
    every = [
        make(found, detail, robot) if robot and make in WITH_ROBOT else make(found, detail)
        for make in SECTIONS
    ]
    return [section for section in every if section.blocks]


def _none(found: Diagnosis) -> str:
    return "nothing is missing" if found.complete else "unexplained residual"


def _time_section(found: Diagnosis, detail: Detail) -> Section:
    blocks: tuple[Block, ...] = ()
    if detail == Detail.PAGE and found.traces is not None:
        traces = (*found.held_out_traces, *found.traces.runs)
        noise = noise_by_joint(found)
        blocks = residuals_in_time(traces, found.joint_names, found.torque_units, noise)
    lead = (
        f"{IN_TIME} of the model with all effects and of the declared one, over a band of "
        f"{noise_in_words(found)}. Shaded: held out."
    )
    return Section("diagnosis-time", "Residual in time", blocks, lead)


def _validity_section(found: Diagnosis, detail: Detail) -> Section:
    runs = found.traces.runs if detail == Detail.PAGE and found.traces is not None else ()
    traces = (*found.held_out_traces, *runs) if runs else ()
    return validity_section(traces, found.processing, found.joint_names, found.torque_units)


def _unexplained_section(found: Diagnosis, detail: Detail) -> Section:
    more, perhaps = rests_in_words(found)
    blocks: list[Block] = [*(Text(text, "bad") for text in more), *perhaps]
    if detail == Detail.PAGE:
        if not blocks:
            none = "The residual depends significantly on no quantity: it behaves like noise."
            blocks.append(Text(none, "good"))
        blocks += _dependences(found)
    lead = (
        "After all effects are in, is what remains of the torque still a function of something? "
        "Every joint's residual is tried against time, angles, speeds and accelerations of all "
        "joints, and its own load, direction and history."
    )
    return Section("diagnosis-unexplained", "Unexplained residual", tuple(blocks), lead)


def _dependences(found: Diagnosis) -> list[Block]:
    """What is left over what it depends on most, and the share that each quantity explains."""
    if found.traces is None:
        return []
    dependence = found.traces.dependence
    most = dependence.shares.max(axis=0)
    kept = [
        int(k) for k in np.argsort(-most, kind="stable")[:_MOST_QUANTITIES] if most[k] >= _WORTH
    ]
    shares = dependence.shares[:, kept].T
    rows = (
        {
            "quantity": covariate_in_words(dependence.quantities[k]),
            **{
                joint: f"{100 * share:.0f}" if share >= _WORTH / 2 else ""
                for joint, share in zip(dependence.joints, own, strict=True)
            },
        }
        for k, own in zip(kept, shares, strict=True)
    )
    table = Table.of(
        "Share of the residual that one quantity explains [%]",
        rows,
        left=("quantity",),
        note="Columns: the joint of the residual. Shares are cross-validated over runs; shares "
        "overlap, since quantities of one motion correlate. The sentences above name the "
        "significant ones.",
        shades=tuple(map(tuple, shares.tolist())),
    )
    none = (
        f"No smooth function of a single quantity predicts {_WORTH:.0%} or more of the residual of "
        "any joint that runs left out confirm."
    )
    pictures = dependence_plots(found, found.traces)
    title = "Residual over the quantities on which the residual depends"
    return [*([Charts(pictures, title)] if pictures else []), table if kept else none]


def _candidates_section(found: Diagnosis, detail: Detail) -> Section:
    """A table for every round."""
    tables = [_round_table(found, each) for each in found.rounds] if detail else []
    blocks: tuple[Block, ...] = tuple(tables)
    if later := blocks[_OPEN_ROUNDS:]:
        first = _OPEN_ROUNDS + 1
        words = f"round {first}" if len(later) == 1 else f"rounds {first} to {len(tables)}"
        folded = Fold(f"The other {counted(len(later), 'round')}: {words}", later)
        blocks = (*blocks[:_OPEN_ROUNDS], folded)
    lead = (
        "Every round judges all candidates beside what was found before and takes the one that "
        "saves most. Shown are the strongest candidates and the verdict on each: the p-value is "
        "corrected for the number of tests; the share is of the residual at that point; the gain "
        "is by how much the error on runs left out falls. One that is refused now may be accepted "
        "in a later round."
    )
    title = "Rejected candidates, with reasons"
    return Section("diagnosis-candidates", title, blocks, lead, on_paper=False)


def _round_table(found: Diagnosis, each: Round) -> Table:
    worst = max(each.residual, key=lambda joint: each.residual[joint])
    unit = dict(zip(found.joint_names, found.torque_units, strict=True)).get(worst, "")
    rows = (
        {
            "candidate": title_of(suspect.effect.kind),
            "where": place_in_words(suspect.effect, len(found.joint_names)),
            "p": p_in_words(suspect.p_value, suspect.least_p),
            "of residual": f"{suspect.share_of_residual:.1%}",
            "gain on data left out": f"{suspect.gain:.1%}",
            "verdict": f"{suspect.verdict}: {suspect.why}" if suspect.why else suspect.verdict,
        }
        for suspect in each.suspects
    )
    return Table.of(
        f"Round {each.index}: largest residual {each.residual[worst]:.3g} {unit} RMS ({worst}); "
        f"{each.verdict} (p: of it alone; sets are judged together)",
        rows,
        words=("candidate", "where", "verdict"),
        bold=tuple(k for k, each in enumerate(each.suspects) if each.verdict is Verdict.ACCEPTED),
    )


def _next_section(found: Diagnosis, detail: Detail) -> Section:
    """On a page; an answer has the names of files to say it with."""
    experiment = next_experiment(found)
    lead = f"Next: plan a motion, to {purpose(found)}."
    if detail < Detail.PAGE:
        return Section("diagnosis-next", "Next motion", (), lead)
    rows = tuple(
        tuple(f"{title_of(each['kind'])} on {', '.join(each['joints'])}" for each in pair.values())
        for pair in experiment["pairs"]
    )
    names = ("found", "indistinguishable from")
    table = (Table("", names, rows, left=names),) if rows else ()
    command = next_command("CONFIG", "DIAGNOSIS.h5")
    return Section("diagnosis-next", "Next motion", (*table, command), lead)


def _data_section(found: Diagnosis, detail: Detail) -> Section:
    blocks: list[Block] = []
    if detail == Detail.VERBOSE:
        blocks.append(_data_in_words(found))
    if detail == Detail.PAGE:
        blocks += data_blocks(found, found.joint_names, _runs(found))
    runs = ", ".join(map(str, found.processing.get("runs", ())))
    lead = (
        f"Made in {found.seconds:.1f} s by `{found.processing.get('command', 'excite diagnose')}`, "
        f"fitted to {runs or 'the data'}, held out: {found.held_out_run}."
    )
    if "--apply" not in str(found.processing.get("command")):
        lead += (
            " To go on with the extended model, `excite diagnose … --apply NEW.yaml` writes this "
            "configuration with the effects that were found."
        )
    return Section("diagnosis-data", "Data and choices", tuple(blocks), lead)


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


def _runs(found: Diagnosis) -> list[Table]:
    """Every run, what it was for, and what is there in it and not in all others."""
    names = [str(each) for each in found.processing.get("runs", ())]
    if len(names) < 2:
        return []
    effects = [each.effect for each in found.effects]
    every = (*found.declared, *effects)
    uses = (*((name, "training") for name in names), (found.held_out_run, "held-out"))
    rows = tuple(
        (name, use, ", ".join(_own(each) for each in every if _within(name, each.runs)) or "–")
        for name, use in uses
    )
    note = (
        "Effects of single runs that are found are never looked for in the held-out one."
        if any(each.runs for each in effects)
        else ""
    )
    columns = ("run", "used as", "in it, not in all")
    return [Table("Runs", columns, rows, left=columns, note=note)]


def _within(name: str, runs: Sequence[str]) -> bool:
    """Whether a run, or a part or the whole of it, is among the runs."""
    return any(
        name == run or name.startswith(f"{run}/") or run.startswith(f"{name}/") for run in runs
    )


def _own(record: EffectRecord) -> str:
    return f"{title_of(record.kind)} on {', '.join(record.joints)}"


WITH_ROBOT: tuple[Callable[..., Section], ...] = (found_section, errors_section)
SECTIONS: list[Callable[..., Section]] = [
    found_section,
    errors_section,
    _time_section,
    evidence_section,
    _validity_section,
    _unexplained_section,
    _next_section,
    _candidates_section,
    _data_section,
]


def _next(found: Diagnosis, config: str, data: Sequence[str | Path], file: str | None) -> Parts:
    """What to do next, with the `file` of the diagnosis: commands that can be typed."""
    given = (as_word(config), *map(as_word, data))
    if set_up_is_open(found):
        return ["Next: resolve the doubt about the set-up:", Command(("excite", "inspect", *given))]
    if file is None:
        again = Command(("excite", "diagnose", *given, "-o", "DIAGNOSIS.h5"))
        return ["Next: keep it in a file, for a report and the next motion:", again]
    if found.complete:
        score = Command(("excite", "score", as_word(file), "DATA.h5"))
        return ["Next: see whether the model holds for other data:", score]
    return [
        f"Next: look at the evidence; plan a motion, to {purpose(found)}:",
        Command(("excite", "report", as_word(file))),
        next_command(config, file),
    ]


def _in_words(found: Diagnosis) -> str:
    """What was found, and the errors before and after."""
    everything = len(found.joint_names)
    effects = ", ".join(what_and_where(each.effect, everything) for each in found.named)
    before, after = found.before.mean_relative_moving, found.after.mean_relative_moving
    return f"{effects or _none(found)}; mean error {before:.2%} → {after:.2%}"


def _named_in_words(named: NamedEffect) -> str:
    """`coulomb_friction on elbow: coulomb 2.998 ± 0.0012 N·m`; joints are named, however many."""
    sizes = (value_in_words(name, value) for name, value in named.parameters.items())
    return f"{what_and_where(named.effect, 0)}: {', '.join(sizes)}"


show(Diagnosis, _in_words, diagnosis_parts, OF_DIAGNOSIS)
show(
    NamedEffect,
    _named_in_words,
    lambda named: [effect_table([named], 0, Detail.VERBOSE), *other_names(named, 0)],
)


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
