"""The smallest margin of every constraint over time, and where it is closest to its bound."""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Constraint
from excite_cli.excitation.admissible import fine_margins
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.proof.certificate import Worst
from excite_cli.report.chart import in_figures
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array

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


def margin_charts(problem: Problem, motion: Motion) -> dict[str, Plot]:
    """A chart per constraint, by its name."""
    return {line.constraint.name: _chart(line) for line in _lines(problem, motion)}


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
