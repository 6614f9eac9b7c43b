"""Every motion joint by joint: position within its limits, speed and acceleration as shares."""

from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.report.campaign import RebuiltResult, in_figures
from excite_cli.report.chart import Colour, limits_about
from excite_cli.report.page import Block, Charts, ChoiceBlock, PageSection, TableBlock, Text
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array

# Instants per card: many joints and motions must not make the page heavy.
_POINTS, _FEWEST_POINTS, _ALL_POINTS = 400, 160, 24_000
_MOST_CHARTS = 120
_WORDS = ("position", "speed", "acceleration", "torque")
_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "purple")


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


def motion_section(campaign: RebuiltResult) -> PageSection:
    """One card per joint, the motion by choice, and a table of peaks behind a fold."""
    problem, motions = campaign.problem, campaign.result.motions
    options = []
    shown = drawn_motions(motions, problem.robot.n)
    for motion in shown:
        signals = _signals(problem, motion, _points(problem.robot.n * len(shown)))
        cards = tuple(
            _card(problem, signals, joint, motion.index) for joint in range(problem.robot.n)
        )
        blocks: tuple[Block, ...] = (Charts(cards), _peaks(problem, signals))
        options.append((f"motion {motion.index}", blocks))
    duration = in_figures(problem.trajectory.duration)
    return PageSection(
        campaign.anchor("motions"),
        campaign.titled("Motions"),
        (*not_drawn(motions, shown), ChoiceBlock("Motion", tuple(options))),
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
        columns = constraint.of_joints
        if columns is not None:
            columns.put_into(lower[columns.quantity], upper[columns.quantity])
    units = tuple(
        ("m", "m/s", "m/s²", "N") if slides else ("rad", "rad/s", "rad/s²", "N·m")
        for slides in robot.sliding
    )
    return _Signals(times, np.stack([q, v, a, torque]), lower, upper, units)


def _shown(signals: _Signals, joint: int) -> list[int]:
    """Orders drawn as shares: speed and acceleration, and the torque where it is bounded."""
    return [1, 2, 3] if np.isfinite(signals.upper[3, joint]) else [1, 2]


def _card(problem: Problem, signals: _Signals, joint: int, motion: int) -> Plot:
    name = problem.robot.joint_names[joint]
    shown = _shown(signals, joint)
    bounded = bool(np.isfinite(signals.upper[shown, joint]).any())
    shares = tuple(_share(signals, order, joint) for order in shown)
    end = 1.15 * max(1.0, *(float(np.abs(each.y).max()) for each in shares))
    beside = Panel(
        f"share of {'limit' if bounded else 'peak'} [–]",
        shares,
        span=(-end, end),
        limits=(-1.0, 1.0) if bounded else (-np.inf, np.inf),
        height=120,
    )
    said = "; ".join(_peak_words(signals, order, joint) for order in (0, *shown))
    return Plot(
        name,
        f"{name}: {said}.",
        "time [s]",
        signals.times,
        (_position(signals, joint), beside),
        link=f"motion {motion}",
    )


def _position(signals: _Signals, joint: int) -> Panel:
    values = signals.values[0, :, joint]
    limits = (float(signals.lower[0, joint]), float(signals.upper[0, joint]))
    finite = [limit for limit in limits if np.isfinite(limit)]
    span = limits_about([values.min(), values.max(), *finite])
    of_q = f"q [{signals.units[joint][0]}]"
    return Panel(of_q, (Curve("position", values, "blue"),), span=span, limits=limits)


def _share(signals: _Signals, order: int, joint: int) -> Curve:
    values, limit = signals.values[order, :, joint], signals.upper[order, joint]
    bounded = bool(np.isfinite(limit))
    size = limit if bounded else float(np.abs(values).max()) or 1.0
    return Curve(_WORDS[order], values / size, _COLOURS[order], "line" if bounded else "dotted")


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


def _peaks(problem: Problem, signals: _Signals) -> TableBlock:
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
    return TableBlock(
        ("joint", "position", "limits", "peak speed", "peak acceleration", "peak torque"),
        tuple(rows),
        title="Ranges and peaks of every joint",
        right=frozenset(range(1, 6)),
        note="In brackets the share of the limit. Torques are those of the URDF's inertias.",
        folded=True,
    )
