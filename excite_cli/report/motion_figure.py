"""Figures of one motion over time: every joint against its limits, and every other margin."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from excite_cli.constraints.base import Constraint
from excite_cli.excitation.admissible import fine_margins, fine_times
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.report.style import (
    BLUE,
    FORBIDDEN,
    GREEN,
    GREY,
    VERMILION,
    WIDTH,
    matplotlib_part,
    new_figure,
    styled,
)
from excite_cli.robot.model import Array, Robot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_POINTS = 600  # per joint and line, over the whole motion
_LIMIT_LINE: dict[str, Any] = {"color": GREY, "linestyle": (0, (4, 2)), "linewidth": 1.0}
_STEPS = (1, 2, 5, 10)
_DOTTED = (0, (1, 1))
# Page layout of the joint grid [in].
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.6, 0.1, 0.95, 0.45


@dataclass(frozen=True)
class _Bounds:
    """Bounds (3, n) on position, velocity and acceleration that the problem keeps."""

    lower: Array
    upper: Array


@styled
def draw_motion(motion: Motion, problem: Problem) -> "Figure":
    """Position of every joint within its limits; below, velocity and acceleration as shares.

    A velocity or acceleration that the problem does not bound is drawn dotted, as a share of its
    own peak.
    """
    robot = problem.robot
    times = fine_times(problem, _POINTS / problem.trajectory.duration)
    states = problem.trajectory.basis(times).states(motion.coefficients)
    bounds, units = _bounds(problem), _position_units(robot)
    columns = _columns(robot.n)
    rows = -(-robot.n // columns)
    height = _TOP + _BOTTOM + rows * (2.5 if columns <= 3 else 2.15)
    figure = new_figure(height, constrained=False)
    outer = figure.add_gridspec(
        rows,
        columns,
        left=_LEFT / WIDTH,
        right=1 - _RIGHT / WIDTH,
        top=1 - _TOP / height,
        bottom=_BOTTOM / height,
        wspace=0.36 if columns <= 3 else 0.48,
        hspace=0.27 if columns <= 3 else 0.32,
    )
    for joint, name in enumerate(robot.joint_names):
        inner = outer[divmod(joint, columns)].subgridspec(2, 1, height_ratios=(5, 3), hspace=0.1)
        upper = figure.add_subplot(inner[0])
        lower = figure.add_subplot(inner[1], sharex=upper)
        upper.set_title(_shortened(name, 40 if columns <= 3 else 22), fontsize=8.5)
        _draw_position(upper, times, states[0][:, joint], bounds, joint)
        upper.set_ylabel(f"q [{units[joint]}]", labelpad=2)
        for order, colour in ((2, GREEN), (1, VERMILION)):
            _draw_share(lower, times, states[order][:, joint], bounds.upper[order, joint], colour)
        bounded = bool(np.isfinite(bounds.upper[1:, joint]).any())
        _finish_band(lower, times, bounded, last=joint + columns >= robot.n)
    _head(figure, motion, problem, height, bool(np.isinf(bounds.upper[1:]).any()))
    return figure


def _shortened(name: str, longest: int) -> str:
    """The name with its middle left out where it would run into the next panel."""
    if len(name) <= longest:
        return name
    head = longest // 2
    return f"{name[:head]}…{name[head + 1 - longest :]}"


def _columns(joints: int) -> int:
    if joints <= 9:
        return min(joints, 3) if joints != 4 else 2
    return 4 if joints <= 16 else 5


def _draw_position(axes: "Axes", times: Array, q: Array, bounds: _Bounds, joint: int) -> None:
    limits = [bounds.lower[0, joint], bounds.upper[0, joint]]
    for limit in limits:
        if np.isfinite(limit):
            axes.axhline(limit, **_LIMIT_LINE)
    axes.plot(times, q, color=BLUE)
    seen = np.array([q.min(), q.max(), *(limit for limit in limits if np.isfinite(limit))])
    pad = 0.08 * max(float(np.ptp(seen)), 1e-3)
    axes.set_ylim(seen.min() - pad, seen.max() + pad)
    axes.yaxis.set_major_locator(matplotlib_part("ticker").MaxNLocator(4, steps=_STEPS))
    axes.tick_params(labelbottom=False, bottom=False, pad=2)


def _draw_share(axes: "Axes", times: Array, values: Array, limit: float, colour: str) -> None:
    if np.isfinite(limit):
        axes.plot(times, values / limit, color=colour, linewidth=1.1)
        return
    peak = float(np.abs(values).max()) or 1.0
    axes.plot(times, values / peak, color=colour, linewidth=1.4, linestyle=_DOTTED)


def _finish_band(axes: "Axes", times: Array, bounded: bool, last: bool) -> None:
    if bounded:
        for side in (-1.0, 1.0):
            axes.axhline(side, **_LIMIT_LINE)
    peak = max(float(np.abs(line.get_ydata()).max()) for line in axes.lines)
    axes.set_ylim(-1.2 * max(1.0, peak), 1.2 * max(1.0, peak))
    axes.set_yticks([-1, 0, 1])
    axes.set_xlim(times[0], times[-1])
    axes.xaxis.set_major_locator(matplotlib_part("ticker").MaxNLocator(5, steps=_STEPS))
    axes.tick_params(pad=2, labelbottom=last)
    axes.set_ylabel("share [–]", labelpad=2)
    if last:
        axes.set_xlabel("time [s]", labelpad=2)


def _head(
    figure: "Figure", motion: Motion, problem: Problem, height: float, unbounded: bool
) -> None:
    """Title with the condition numbers, and one legend for all panels."""
    figure.suptitle(
        f"{problem.robot.name}, motion {motion.index}: condition number "
        f"{motion.condition_number:.2f} alone, {motion.stacked_condition_number:.2f} stacked",
        x=_LEFT / WIDTH,
        y=1 - 0.12 / height,
        ha="left",
        va="top",
    )
    line = matplotlib_part("lines").Line2D
    handles = [
        line([], [], color=BLUE, label="position q"),
        line([], [], color=VERMILION, label="velocity, share of limit"),
        line([], [], color=GREEN, label="acceleration, share of limit"),
        line([], [], label="limit", **_LIMIT_LINE),
    ]
    if unbounded:
        handles.append(
            line([], [], color="black", linestyle=_DOTTED, label="no limit: share of peak")
        )
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=((_LEFT - 0.1) / WIDTH, 1 - 0.38 / height),
        ncols=len(handles),
        columnspacing=1.4,
        handlelength=1.8,
    )


def _bounds(problem: Problem) -> _Bounds:
    lower = np.full((3, problem.robot.n), -np.inf)
    upper = -lower
    for constraint in problem.constraints:
        columns = constraint.linear
        if columns is not None:
            columns.put_into(lower[columns.quantity], upper[columns.quantity])
    return _Bounds(lower, upper)


def _position_units(robot: Robot) -> list[str]:
    return ["m" if slides else "rad" for slides in robot.sliding]


def watched_constraints(problem: Problem) -> tuple[Constraint, ...]:
    """Constraints other than the bounds of single joints: those that `draw_margins` shows."""
    return tuple(c for c in problem.constraints if c.linear is None)


@styled
def draw_margins(motion: Motion, problem: Problem) -> "Figure":
    """Smallest margin over the columns of each watched constraint, at controller rate.

    Margins of single joints (torque) are divided by their limits, so that joints, rotating or
    sliding, compare.
    """
    times = fine_times(problem)
    all_margins = fine_margins(problem, motion.coefficients, times)
    parts = [
        (constraint, margins)
        for constraint, margins in zip(problem.constraints, all_margins, strict=True)
        if constraint.linear is None
    ]
    figure = new_figure(0.8 + 1.75 * len(parts))
    figure.suptitle(
        f"{problem.robot.name}, motion {motion.index}: margins of the constraints",
        x=0.01,
        ha="left",
    )
    stacked = figure.subplots(len(parts), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (constraint, margins) in zip(stacked, parts, strict=True):
        _draw_margin(axes, constraint, margins, times)
    stacked[-1].set_xlabel("time [s]")
    stacked[-1].set_xlim(times[0], times[-1])
    return figure


def _draw_margin(axes: "Axes", constraint: Constraint, margins: Array, times: Array) -> None:
    shares = constraint.of_joints is not None
    values = margins / constraint.scale if shares else margins
    units = dict.fromkeys(constraint.unit_of(column) for column in range(len(constraint.labels)))
    smallest = values.min(axis=1)
    worst = int(np.argmin(smallest))
    top = max(float(smallest.max()), 1e-6)
    bottom = min(float(smallest.min()), 0.0) - 0.12 * top
    axes.axhspan(bottom, 0.0, color=FORBIDDEN, linewidth=0)
    axes.axhline(0.0, **_LIMIT_LINE)
    axes.plot(times, smallest, color=BLUE)
    axes.plot(times[worst], smallest[worst], "o", color=VERMILION, markersize=5, clip_on=False)
    axes.set_ylim(bottom, 1.08 * top)
    column = int(np.argmin(values[worst]))
    unit = "" if shares else f" {constraint.unit_of(column)}"
    axes.set_title(constraint.title)
    axes.set_title(
        f"worst: {smallest[worst]:.3g}{unit} at {times[worst]:.2f} s, {constraint.labels[column]}",
        loc="right",
        color=VERMILION,
        fontsize=8.5,
    )
    axes.set_ylabel("share of limit [–]" if shares else f"margin [{', '.join(units)}]")
