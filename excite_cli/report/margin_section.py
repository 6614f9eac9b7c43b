"""How far every constraint stays from its bound over time, where it is closest, what is proved."""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Constraint
from excite_cli.excitation.admissible import fine_margins
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.geometry.reasons import reason_in_words
from excite_cli.proof.certificate import Worst
from excite_cli.report.campaign import RebuiltResult, in_figures
from excite_cli.report.motion_section import drawn_motions, not_drawn
from excite_cli.report.page import (
    Block,
    Charts,
    ChoiceBlock,
    KeyFigure,
    PageSection,
    TableBlock,
    Text,
)
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array
from excite_cli.summary.pairs import counted, doubts_in_words, unguarded_in_words, unjudged

_POINTS = 400


@dataclass(frozen=True)
class _Line:
    """The smallest margin (T,) of a constraint over all its columns, as it is drawn.

    `unit` is `–` where margins are shares of the columns' scales.
    """

    constraint: Constraint
    times: Array
    values: Array
    unit: str
    worst: Worst
    proved: bool | None
    link: str


def margin_section(campaign: RebuiltResult) -> PageSection:
    """A table of the worst margins, and every margin over time, the motion by choice."""
    problem, result = campaign.problem, campaign.result
    anchor, title = campaign.anchor("margins"), campaign.titled("Margins")
    if not problem.constraints:
        none = Text("The problem has no constraints, so there is nothing to keep away from.")
        return PageSection(anchor, title, (none,))
    options = []
    shown = drawn_motions(result.motions, len(problem.constraints))
    for motion in shown:
        charts = tuple(_chart(line) for line in _lines(problem, motion))
        blocks: tuple[Block, ...] = (Charts(charts),)
        options.append((f"motion {motion.index}", blocks))
    return PageSection(
        anchor,
        title,
        (
            _verdict(result),
            worst_table(result, problem.constraints),
            *_pairs(problem),
            *not_drawn(result.motions, shown),
            ChoiceBlock("Motion", tuple(options)),
        ),
        "A margin is what is left beyond what the config asks to keep. Shaded: forbidden; the dot "
        "is the worst instant.",
    )


def margin_figures(campaign: RebuiltResult) -> tuple[KeyFigure, ...]:
    """Whether all constraints are proved."""
    if not campaign.problem.constraints:
        return ()
    found = [proved for m in campaign.result.motions for proved in m.certified.values()]
    of = "" if campaign.alone else f", {campaign.name}"
    broken = sum(w.violations > 0 for m in campaign.result.motions for w in m.margins.values())
    if broken:
        return (KeyFigure(f"constraints{of}", f"{broken} BROKEN", "at controller rate"),)
    doubted = any(motion.doubt for motion in campaign.result.motions)
    if doubted or not found:
        why = "not as they were proved" if doubted else "not proved between instants"
        return (KeyFigure(f"constraints{of}", "kept at 1 kHz", why),)
    all_of = f"{sum(found)} of {len(found)}"
    if all(found):
        return (KeyFigure(f"constraints{of}", "all proved", "at every instant of every motion"),)
    return (KeyFigure(f"constraints{of}", f"{all_of} proved", "the others kept at 1 kHz"),)


def _verdict(result: Result) -> Text:
    doubts = doubts_in_words(result.motions)
    loose = [
        f"{name} (motion {motion.index})"
        for motion in result.motions
        for name, proved in motion.certified.items()
        if not proved
    ]
    broken = [
        f"{name} (motion {motion.index})"
        for motion in result.motions
        for name, worst in motion.margins.items()
        if worst.violations
    ]
    if broken:
        return Text(f"Broken at controller rate: {', '.join(broken)}.", "bad")
    if doubts:
        words = "; ".join(doubts)
        return Text(f"Kept at every millisecond, but {words}. `excite check` judges it.", "bad")
    if not any(motion.certified for motion in result.motions):
        return Text(
            "Kept at every millisecond. Between these instants nothing was proved when the motions "
            "were made (optimizer.certify: false); `excite check CONFIG FILE.h5` does.",
            "plain",
        )
    if loose:
        return Text(
            f"Kept at every millisecond; not proved between: {', '.join(loose)}. "
            "`excite check CONFIG FILE.h5` says why.",
            "bad",
        )
    return Text("Every constraint of every motion is proved to hold at every instant.", "good")


def _pairs(problem: Problem) -> list[Block]:
    """How many pairs of bodies the verdicts speak of, and all that they do not speak of."""
    told: list[Block] = [Text(words, "bad") for words in unguarded_in_words(problem)]
    told += [Text(words) for words in counted(problem)]
    left = unjudged(problem)
    if left:
        rows = [(f"{pair.first} – {pair.second}", reason_in_words(pair.reason)) for pair in left]
        title = "Link pairs that are not checked"
        told.append(TableBlock(("pair", "why"), tuple(rows), title=title, wordy=frozenset({0, 1})))
    return told


def worst_table(result: Result, constraints: tuple[Constraint, ...]) -> TableBlock:
    """The worst margin of every constraint over all motions: how much, where, when, proved."""
    rows = []
    for name in dict.fromkeys(constraint.name for constraint in constraints):
        held = [motion for motion in result.motions if name in motion.margins]
        if not held:
            continue
        motion = min(held, key=lambda m: m.margins[name].share)
        worst = motion.margins[name]
        states = [m.certified[name] for m in held if name in m.certified]
        proved = "–" if not states else "proved" if all(states) else "sampled"
        rows.append(
            (
                name,
                f"{in_figures(worst.margin)} {worst.unit}",
                f"{100 * worst.share:.2g} %",
                worst.label,
                str(motion.index),
                f"{worst.time:.3f}",
                "BROKEN" if worst.violations else proved,
            )
        )
    return TableBlock(
        ("constraint", "worst margin", "share", "where", "motion", "time [s]", "verdict"),
        tuple(rows),
        title="Worst margins over all motions, at 1 kHz",
        right=frozenset({1, 2, 4, 5}),
        wordy=frozenset({3}),
        note="Share of the size of what is bounded: half a range, a limit, a distance.",
    )


def _lines(problem: Problem, motion: Motion) -> list[_Line]:
    """Margins on a grid that holds the worst instants, which were found at 1 kHz."""
    grid = np.linspace(0.0, problem.trajectory.duration, _POINTS)
    times = np.union1d(grid, [worst.time for worst in motion.margins.values()])
    margins = fine_margins(problem, motion.coefficients, times)
    return [
        _line(constraint, margin, times, motion)
        for constraint, margin in zip(problem.constraints, margins, strict=True)
    ]


def _line(constraint: Constraint, margins: Array, times: Array, motion: Motion) -> _Line:
    units = {constraint.unit_of(column) for column in range(len(constraint.labels))}
    shares = constraint.of_joints is not None or len(units) > 1
    values = (margins / constraint.scale if shares else margins).min(axis=1)
    seen = Worst.of(constraint, margins, times)
    stored = motion.margins.get(constraint.name)
    return _Line(
        constraint=constraint,
        times=times,
        values=values,
        unit="–" if shares else constraint.unit,
        worst=seen if stored is None else stored,
        proved=motion.certified.get(constraint.name),
        link=f"margins of motion {motion.index}",
    )


def _chart(line: _Line) -> Plot:
    index = int(np.argmin(line.values))
    smallest, worst = float(line.values[index]), line.worst
    top = max(float(line.values.max()), 1e-9)
    dot = np.full(len(line.times), np.inf)
    dot[index] = smallest
    of_joints = line.constraint.of_joints is not None
    share = "share of limit" if of_joints else "share of its scale"
    what = share if line.unit == "–" else "margin"
    panel = Panel(
        f"{what} [{line.unit}]",
        (
            Curve("smallest margin", line.values, "blue"),
            Curve("worst", dot, "vermilion", "marks"),
        ),
        span=(min(smallest, 0.0) - 0.15 * top, 1.08 * top),
        limits=(0.0, np.inf),
    )
    name = line.constraint.name
    title = line.constraint.title
    state = {None: "", True: " Proved at every instant.", False: " Not proved between samples."}
    said = (
        f"Closest: {in_figures(worst.margin)} {worst.unit} at {worst.time:.3f} s, {worst.label}."
        f"{state[line.proved]}"
    )
    return Plot(
        title,
        f"{title} ({name}). {said}",
        "time [s]",
        line.times,
        (panel,),
        link=line.link,
        caption=said,
    )
