"""A stored model beside new data, in sentences, tables and as data."""

from math import isfinite, isnan
from typing import Any

import numpy as np

from excite_cli.diagnosis.words import place_in_words, title_of, value_in_words
from excite_cli.fields import data_of
from excite_cli.identification.fit_words import short_number
from excite_cli.report.chart import Colour
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.scoring.records import RunExplanation, Score, ScoredRun
from excite_cli.scoring.score import NOT_THIS_ROBOT
from excite_cli.scoring.thresholds import Thresholds
from excite_cli.shown.answer import (
    Answer,
    Block,
    Charts,
    KeyFigure,
    Parts,
    Section,
    Table,
    parts_of,
    show,
)
from excite_cli.summary.cells import figure, findings_data, percent

# Thresholds of a collision detector in words and as a table.


def thresholds_parts(found: Thresholds) -> Parts:
    """Level and coefficients of every joint."""
    figures = zip(found.joint_names, found.level, found.coefficients, strict=True)
    rows = tuple((name, *(f"{x:.4g}" for x in (level, *c))) for name, level, c in figures)
    columns = ("joint", "level", "c0", "c1", "c2", "c3")
    return [_in_words(found), Table("", columns, rows, left=("joint",))]


def _in_words(found: Thresholds) -> str:
    return (
        f"{len(found.joint_names)} joints, {found.false_alarms:.3g} false alarms an hour, "
        f"time constant {found.time_constant:.3g} s"
    )


show(Thresholds, _in_words, thresholds_parts)


_TOLD = 3  # runs in the sentence
_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "purple", "ink", "muted")


def score_answer(found: Score) -> Answer:
    """What `excite score` answers; status 1 where a run leaves what the model allows."""
    return Answer(tuple(score_parts(found)), score_data(found), not found.alarms)


def score_parts(found: Score) -> Parts:
    """A sentence, the runs, and errors per joint."""
    return [*sentences(found), *parts_of(score_sections(found))]


def score_sections(found: Score) -> list[Section]:
    """Ratios over the runs, the runs with their reasons, and the joints."""
    ratios = [Charts((_plot(found),))] if found.made is not None and len(found.runs) > 1 else []
    every = [
        Section("ratios", "Residual over the runs", tuple(ratios)),
        Section("runs", "Runs", (runs_table(found),)),
        Section("joints", "Joints", (joints_table(found),)),
        Section("drift", "Drift of a simulation", _drift_blocks(found)),
    ]
    return [section for section in every if section.blocks]


def score_figures(score: Score) -> tuple[KeyFigure, ...]:
    """What sums a score up."""
    made = "" if score.made is None else f"{score.made.mean_relative_moving:.2%} when it was made"
    return (
        KeyFigure("error on these runs, moving", f"{score.error.mean_relative_moving:.2%}", made),
        KeyFigure(
            "runs beyond the model's tolerance",
            f"{len(score.alarms)} of {len(score.runs)}",
            "tolerance: residual of the model on its own data, in proportion to the torque",
            "bad" if score.alarms else "good",
        ),
    )


def _plot(score: Score) -> Plot:
    count = len(score.runs)
    series = tuple(
        Curve(
            joint,
            np.array([run.ratio.get(joint, np.nan) for run in score.runs]),
            _COLOURS[k % len(_COLOURS)],
            "joined",
        )
        for k, joint in enumerate(score.joint_names)
    )
    alarms = ", ".join(run.name for run in score.alarms) or "none"
    return Plot(
        "RMS of the residual over the model's tolerance",
        f"Ratio of every joint over {count} runs; alarms: {alarms}.",
        "run",
        np.arange(1.0, count + 1.0),
        (Panel("ratio", series, height=240),),
        caption="1: as on the day the model was made. Runs are numbered as in the table.",
        wide=True,
        counted=True,
    )


def sentences(found: Score) -> list[str]:
    """How well the model predicts, and what happened in runs that leave what it allows."""
    mean = percent(found.error.mean_relative_moving)
    made = ""
    if found.made is not None:
        made = f"; {percent(found.made.mean_relative_moving)} when the model was made"
    runs = f"{len(found.runs)} run{'s' * (len(found.runs) > 1)}"
    first = (
        f"{found.model}: torque error {mean} on {runs}, where joints move (mean over joints{made})."
    )
    if found.made is None:
        return [first]
    if not found.alarms:
        return [f"{first} All runs are within the model's tolerance.", *_not_judged(found)]
    told = [f"{run.name}: {in_words(run, found)}" for run in found.alarms[:_TOLD]]
    more = len(found.alarms) - _TOLD
    if more > 0:
        told.append(f"and {more} more: see the table")
    count = f"{len(found.alarms)} of {len(found.runs)}"
    alarm = f"{count} runs exceed the model's tolerance. {'. '.join(told)}."
    return [alarm, first, *_not_judged(found)]


def _not_judged(found: Score) -> list[str]:
    """A sentence on runs in which friction may explain everything."""
    names = [run.name for run in found.runs if not run.judged]
    if not names:
        return []
    more = f" and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
    return [
        f"Not judged: {', '.join(names[:_TOLD])}{more}. Joints stand there, or move more slowly "
        "than in the model's own data, so friction may explain the whole residual."
    ]


def in_words(run: ScoredRun, found: Score) -> str:
    """What explains a run, or that nothing does."""
    if not run.left:
        return "within the model's tolerance"
    beyond = _beyond(run)
    if not run.reasons and run.error.mean_relative_moving > NOT_THIS_ROBOT:
        return (
            f"{beyond}; no payload, friction or other change explains it: these data seem to be of "
            "another robot"
        )
    if not run.reasons:
        return f"{beyond}; nothing that changes from day to day explains it"
    return f"{beyond}: {' and '.join(_reason(each, found) for each in run.reasons)}"


def _beyond(run: ScoredRun) -> str:
    worst = max(run.left, key=lambda joint: max(run.ratio[joint], run.peak[joint] / 2.5))
    return f"{short_number(run.ratio[worst], 2)} times the tolerance on {worst}"


def _reason(reason: RunExplanation, found: Score) -> str:
    place = place_in_words(reason.effect, len(found.joint_names))
    name, value = next(iter(reason.parameters.items()))
    return (
        f"{title_of(reason.effect.kind)}{place and ' at ' + place}, {value_in_words(name, value)}"
    )


def runs_table(found: Score) -> Table:
    """Every run with its error, state and likely reason."""
    rows = (
        {
            "run": run.name,
            "seconds": f"{run.seconds:.4g}",
            "error, moving": percent(run.error.mean_relative_moving),
            "error, all": percent(run.error.mean_relative),
            "multiple": _worst(run),
            "state": "ALARM" * run.alarm or "not judged" * bool(found.made and not run.judged),
            "likely reason": ", ".join(title_of(each.effect.kind) for each in run.reasons)
            * run.alarm,
        }
        for run in found.runs
    )
    return Table.of(
        "Runs: torque error, and its part beyond friction as a multiple of what the model leaves",
        rows,
        left=("run", "state"),
        words=("likely reason",),
        bold=tuple(k for k, run in enumerate(found.runs) if run.alarm),
    )


def _worst(run: ScoredRun) -> str:
    known = [x for x in run.ratio.values() if isfinite(x)]
    return f"{max(known):.2f}" if known else ""


def joints_table(found: Score) -> Table:
    """Every joint's error over all runs, beside that when the model was made."""
    made = found.made
    rows = (
        {
            "joint": joint,
            "error, moving": percent(found.error.relative_moving[joint]),
            "when made": percent(made.relative_moving[joint]) if made else "",
            "RMS, all": figure(found.error.rms[joint]),
            "RMS when made": figure(made.rms[joint]) if made else "",
            "noise": figure(found.noise[joint]) if joint in found.noise else "",
            "unit": unit,
            "worst run": max(found.runs, key=lambda run: _ratio(run, joint)).name if made else "",
        }
        for joint, unit in zip(found.joint_names, found.units, strict=True)
        if not isnan(found.error.rms[joint])  # its torque was not measured
    )
    title = "Joints: torque error over all runs, and when the model was made"
    return Table.of(title, rows, left=("joint", "unit", "worst run"))


def _drift_blocks(found: Score) -> tuple[Block, ...]:
    """A table of horizons, or why there is none."""
    if not found.drift:
        why = found.not_simulated and f"No drift of a simulation: {found.not_simulated}"
        return (why,) if why else ()
    rows = []
    for each in found.drift:
        joint = max(each.worst, key=each.worst.__getitem__)
        rows.append({
            "after": f"{each.horizon:g} s",
            "starts": str(each.starts),
            "drift": _milli(each.median),
            "stands still": _milli(each.still),
            "keeps speed": _milli(each.steady),
            "worst": f"{1e3 * each.worst[joint]:.3g}",
            "on": joint,
            "drift farther than they move": ", ".join(each.beyond) or "none",
        })  # fmt: skip
    sliding = [unit == "N" for unit in found.units]
    unit = "mm" if all(sliding) else "mrad (mm)" if any(sliding) else "mrad"
    table = Table.of(
        f"Drift of a simulation from the robot, driven by what was recorded [{unit}]",
        rows,
        left=("on",),
        words=("drift farther than they move",),
        note="drift: median over starts from measured states, mean over joints; stands still, "
        "keeps speed: the same of a guess without a model, that the robot does so.",
    )
    return (table,)


def _milli(of: dict[str, float]) -> str:
    return f"{1e3 * sum(of.values()) / len(of):.3g}"


def _ratio(run: ScoredRun, joint: str) -> float:
    ratio = run.ratio.get(joint, 0.0)
    return ratio if isfinite(ratio) else 0.0


def score_data(found: Score) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "good": not found.alarms,
        "answer": sentences(found),
        **data_of(found, "model", "error", "made", "noise", "drift", "not_simulated"),
        "findings": findings_data(found.findings),
        "runs": [_run_data(run, found) for run in found.runs],
    }


def _run_data(run: ScoredRun, found: Score) -> dict[str, Any]:
    own = ("name", "file", "seconds", "allowed", "ratio", "peak", "alarm", "judged", "covariates")
    return {
        **data_of(run, *own, "epoch", "drift"),
        **data_of(run.error, "relative_moving", "relative", "rms", "samples"),
        "joints": list(run.left),
        "reasons": [
            {
                **data_of(each.effect, "kind", "joints", "shape", "values"),
                **data_of(each, "parameters", "share"),
            }
            for each in run.reasons
        ],
        "in_words": in_words(run, found),
    }


def _run_in_words(run: ScoredRun) -> str:
    """`monday: 1.2% of the torque; within the model's tolerance`."""
    state = (
        _beyond(run) if run.left else "within the model's tolerance" if run.judged else "not judged"
    )
    return f"{run.name}: {percent(run.error.mean_relative_moving)} of the torque; {state}"


def _run_parts(run: ScoredRun) -> Parts:
    rows = []
    for joint, rms in run.error.rms.items():
        ratio, allowed = run.ratio.get(joint), run.allowed.get(joint)
        rows.append(
            {
                "joint": joint,
                "where moving": percent(run.error.relative_moving[joint]),
                "RMS": figure(rms),
                "beyond friction": "" if ratio is None else figure(ratio * run.allowed[joint]),
                "tolerance": "" if allowed is None else figure(allowed),
                "ratio": "" if ratio is None else figure(ratio),
            }
        )
    bold = tuple(k for k, row in enumerate(rows) if row["joint"] in run.left)
    return [_run_in_words(run), Table.of("", rows, left=("joint",), bold=bold)]


show(ScoredRun, _run_in_words, _run_parts)
show(Score, lambda found: sentences(found)[0], score_parts)
