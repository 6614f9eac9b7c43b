"""Every motion joint by joint: position within its limits, speed and acceleration as shares."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.constraints.joint_bound import JointBound
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.report.campaign import Campaign, in_figures
from excite_cli.report.chart import (
    BLUE,
    FORBIDDEN,
    GREEN,
    LIMIT,
    PURPLE,
    VERMILION,
    Chart,
    draw_chart,
    few_ticks,
    limits_about,
    time_axis,
)
from excite_cli.report.page import Block, Charts, Choice, Section, Table, Text
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Instants per card: many joints and motions must not make the page heavy.
_POINTS, _FEWEST_POINTS, _ALL_POINTS = 400, 160, 24_000
_MOST_CHARTS = 120
_WORDS = ("position", "speed", "acceleration", "torque")
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE)


@dataclass(frozen=True)
class _Signals:
    """Position, velocity, acceleration and torque (4, T, n) of a motion with bounds (4, n).

    Lower bounds of all but positions are minus the upper ones; infinite where there is none.
    """

    times: Array
    values: Array
    lower: Array
    upper: Array
    units: tuple[tuple[str, ...], ...]


def motion_section(campaign: Campaign) -> Section:
    """One card per joint, the motion by choice, and a table of peaks behind a fold."""
    problem, motions = campaign.problem, campaign.result.motions
    options = []
    shown = drawn_motions(motions, problem.robot.n)
    for motion in shown:
        signals = _signals(problem, motion, _points(problem.robot.n * len(shown)))
        cards = tuple(_card(problem, signals, joint) for joint in range(problem.robot.n))
        blocks: tuple[Block, ...] = (Charts(cards), _peaks(problem, signals))
        options.append((f"motion {motion.index}", blocks))
    duration = in_figures(problem.trajectory.duration)
    return Section(
        campaign.anchor("motions"),
        campaign.titled("Motions"),
        (*not_drawn(motions, shown), Choice("Motion", tuple(options))),
        f"{campaign.motions} of {duration} s, {problem.robot.n} joints. Shaded: beyond a limit. "
        "Speed, acceleration and (where the torque is bounded) the torque of the URDF's inertias "
        "are drawn as shares of their limits; dotted: there is no limit, share of the own peak.",
    )


def drawn_motions(motions: tuple[Motion, ...], charts: int) -> tuple[Motion, ...]:
    """The first motions, as many as a page can carry with so many `charts` each."""
    return motions[: max(1, _MOST_CHARTS // charts)]


def not_drawn(motions: tuple[Motion, ...], shown: tuple[Motion, ...]) -> tuple[Text, ...]:
    """A sentence about motions that are left out, if any are."""
    if len(shown) == len(motions):
        return ()
    return (
        Text(
            f"The first {len(shown)} of {len(motions)} motions are drawn; `excite report FILE.h5 "
            "--figures DIR` draws all.",
        ),
    )


def _points(cards: int) -> int:
    return int(np.clip(_ALL_POINTS // max(cards, 1), _FEWEST_POINTS, _POINTS))


def _signals(problem: Problem, motion: Motion, points: int) -> _Signals:
    robot = problem.robot
    times = np.linspace(0.0, problem.trajectory.duration, points)
    q, v, a = problem.trajectory.basis(times).states(motion.coefficients)
    torque = InverseDynamics(robot).torques(q, v, a)[:, -robot.n :]
    lower = np.full((4, robot.n), -np.inf)
    upper = -lower
    for constraint in problem.constraints:
        if isinstance(constraint, JointBound):
            low = constraint.signs < 0
            lower[constraint.order, constraint.joints[low]] = -constraint.bounds[low]
            upper[constraint.order, constraint.joints[~low]] = constraint.bounds[~low]
        if isinstance(constraint, JointTorque):
            upper[3, constraint.joints] = constraint.scale
    lower[3] = -upper[3]
    units = tuple(
        ("m", "m/s", "m/s²", "N") if slides else ("rad", "rad/s", "rad/s²", "N·m")
        for slides in robot.sliding
    )
    return _Signals(times, np.stack([q, v, a, torque]), lower, upper, units)


def _shown(signals: _Signals, joint: int) -> list[int]:
    """Orders drawn as shares: speed and acceleration, and the torque where it is bounded."""
    return [1, 2, 3] if np.isfinite(signals.upper[3, joint]) else [1, 2]


def _card(problem: Problem, signals: _Signals, joint: int) -> Chart:
    name = problem.robot.joint_names[joint]

    def draw(figure: "Figure") -> None:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(5, 4))
        _draw_position(upper, signals, joint)
        for order in _shown(signals, joint):
            _draw_share(lower, signals, order, joint)
        bounded = bool(np.isfinite(signals.upper[_shown(signals, joint), joint]).any())
        _finish_shares(lower, bounded)
        time_axis(lower, signals.times)
        few_ticks(upper)
        lower.xaxis.set_major_locator(upper.xaxis.get_major_locator())
        lower.set_yticks([-1, 0, 1])
        upper.tick_params(labelbottom=False, bottom=False)
        figure.legend(
            handles=[*upper.lines[-1:], *lower.lines[-len(_shown(signals, joint)) :]],
            loc="lower center", ncols=4, handlelength=1.2, columnspacing=0.9, handletextpad=0.4,
            borderaxespad=0.1,
        )  # fmt: skip

    said = "; ".join(_peak_words(signals, order, joint) for order in (0, *_shown(signals, joint)))
    return draw_chart(name, f"{name}: {said}.", draw, 2.7, layout=(0.6, 0.07, 0.08, 0.6))


def _draw_position(axes: "Axes", signals: _Signals, joint: int) -> None:
    values = signals.values[0, :, joint]
    limits = (signals.lower[0, joint], signals.upper[0, joint])
    finite = [limit for limit in limits if np.isfinite(limit)]
    low, high = limits_about([values.min(), values.max(), *finite])
    axes.set_ylim(low, high)
    for limit, end in zip(limits, (low, high), strict=True):
        if np.isfinite(limit):
            axes.axhspan(limit, end, color=FORBIDDEN, linewidth=0)
            axes.axhline(limit, color=LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))
    axes.plot(signals.times, values, color=BLUE, label="position")
    axes.set_ylabel(f"q [{signals.units[joint][0]}]", labelpad=2)


def _draw_share(axes: "Axes", signals: _Signals, order: int, joint: int) -> None:
    values, limit = signals.values[order, :, joint], signals.upper[order, joint]
    bounded = bool(np.isfinite(limit))
    size = limit if bounded else float(np.abs(values).max()) or 1.0
    axes.plot(
        signals.times, values / size, color=_COLOURS[order], linewidth=1.1,
        linestyle="-" if bounded else (0, (1, 1)), label=_WORDS[order],
    )  # fmt: skip


def _finish_shares(axes: "Axes", bounded: bool) -> None:
    peak = max(float(np.abs(line.get_ydata()).max()) for line in axes.lines)
    end = 1.15 * max(1.0, peak)
    for side in (-1.0, 1.0) if bounded else ():
        axes.axhspan(side, side * end, color=FORBIDDEN, linewidth=0, zorder=0.5)
    axes.set_ylim(-end, end)
    axes.set_ylabel(f"share of {'limit' if bounded else 'peak'} [–]", labelpad=2, fontsize=7.5)


def _peak_words(signals: _Signals, order: int, joint: int) -> str:
    values, unit = signals.values[order, :, joint], signals.units[joint][order]
    if order == 0:
        limits = f"{_bound(signals.lower[0, joint])} to {_bound(signals.upper[0, joint])}"
        return (
            f"position from {in_figures(float(values.min()))} to "
            f"{in_figures(float(values.max()))} {unit}, limits {limits}"
        )
    return f"{_WORDS[order]} up to {_peak(signals, order, joint)}"


def _peak(signals: _Signals, order: int, joint: int) -> str:
    peak, limit = float(np.abs(signals.values[order, :, joint]).max()), signals.upper[order, joint]
    share = f" ({100 * peak / limit:.0f} %)" if np.isfinite(limit) else ""
    return f"{in_figures(peak)} {signals.units[joint][order]}{share}"


def _bound(limit: float) -> str:
    return in_figures(float(limit)) if np.isfinite(limit) else "none"


def _peaks(problem: Problem, signals: _Signals) -> Table:
    """What every joint does at most, with the share of its limit."""
    rows = []
    for joint, name in enumerate(problem.robot.joint_names):
        q, unit = signals.values[0, :, joint], signals.units[joint][0]
        limits = f"{_bound(signals.lower[0, joint])} … {_bound(signals.upper[0, joint])}"
        rows.append(
            (
                name,
                f"{in_figures(float(q.min()))} … {in_figures(float(q.max()))} {unit}",
                limits,
                *(_peak(signals, order, joint) for order in (1, 2, 3)),
            )
        )
    return Table(
        ("joint", "position", "limits", "peak speed", "peak acceleration", "peak torque"),
        tuple(rows),
        title="Ranges and peaks of every joint",
        right=frozenset(range(1, 6)),
        note="In brackets the share of the limit. Torques are those of the URDF's inertias.",
        folded=True,
    )
