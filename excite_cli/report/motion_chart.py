"""A motion joint by joint, and the margins of its constraints, over time."""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Constraint
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.excitation.admissible import fine_margins
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.proof.certificate import Worst
from excite_cli.report.chart import Colour, in_figures, limits_about
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Table

_WORDS = ("position", "speed", "acceleration", "jerk", "torque")
_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "ink", "purple")


@dataclass(frozen=True)
class Signals:
    """Position to jerk, then torque (5, T, n) of a motion, by `Quantity`, with bounds (5, n).

    Lower bounds of all but positions are minus the upper ones; infinite where there is none.
    """

    times: Array
    values: Array
    lower: Array
    upper: Array
    units: tuple[tuple[str, ...], ...]


def signals_of(problem: Problem, motion: Motion, points: int) -> Signals:
    """At so many instants, evenly."""
    robot = problem.robot
    times = np.linspace(0.0, problem.trajectory.duration, points)
    q, v, a, jerk = problem.trajectory.orders(times, motion.coefficients)
    torque = InverseDynamics(robot).torques(q, v, a)[:, -robot.n :]
    lower = np.full((len(Quantity), robot.n), -np.inf)
    upper = -lower
    for constraint in problem.constraints:
        columns = constraint.of_joints
        if columns is not None:
            columns.put_into(lower[columns.quantity], upper[columns.quantity])
    units = tuple(
        ("m", "m/s", "m/s²", "m/s³", "N") if slides else ("rad", "rad/s", "rad/s²", "rad/s³", "N·m")
        for slides in robot.sliding
    )
    return Signals(times, np.stack([q, v, a, jerk, torque]), lower, upper, units)


def _shown(signals: Signals, joint: int) -> list[int]:
    """What is drawn as shares: speed and acceleration; jerk and torque where they are bounded."""
    bounded = (k for k in (Quantity.JERK, Quantity.TORQUE) if np.isfinite(signals.upper[k, joint]))
    return [Quantity.VELOCITY, Quantity.ACCELERATION, *bounded]


def motion_cards(problem: Problem, signals: Signals, motion: int) -> tuple[Plot, ...]:
    """A card per joint; those of one `motion` are zoomed together."""
    return tuple(_card(problem, signals, joint, motion) for joint in range(problem.robot.n))


def _card(problem: Problem, signals: Signals, joint: int, motion: int) -> Plot:
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


def _position(signals: Signals, joint: int) -> Panel:
    values = signals.values[0, :, joint]
    limits = (float(signals.lower[0, joint]), float(signals.upper[0, joint]))
    finite = [limit for limit in limits if np.isfinite(limit)]
    span = limits_about([values.min(), values.max(), *finite])
    of_q = f"q [{signals.units[joint][0]}]"
    return Panel(of_q, (Curve("position", values, "blue"),), span=span, limits=limits)


def _share(signals: Signals, order: int, joint: int) -> Curve:
    values, limit = signals.values[order, :, joint], signals.upper[order, joint]
    bounded = bool(np.isfinite(limit))
    size = limit if bounded else float(np.abs(values).max()) or 1.0
    return Curve(_WORDS[order], values / size, _COLOURS[order], "line" if bounded else "dotted")


def _peak_words(signals: Signals, order: int, joint: int) -> str:
    values, unit = signals.values[order, :, joint], signals.units[joint][order]
    if order == 0:
        limits = f"{_bound(signals.lower[0, joint])} to {_bound(signals.upper[0, joint])}"
        return (
            f"position from {in_figures(float(values.min()))} to "
            f"{in_figures(float(values.max()))} {unit}, limits {limits}"
        )
    return f"{_WORDS[order]} up to {_peak(signals, order, joint)}"


def _peak(signals: Signals, order: int, joint: int) -> str:
    peak, limit = float(np.abs(signals.values[order, :, joint]).max()), signals.upper[order, joint]
    share = f" ({100 * peak / limit:.0f} %)" if np.isfinite(limit) else ""
    return f"{in_figures(peak)} {signals.units[joint][order]}{share}"


def _bound(limit: float) -> str:
    return in_figures(float(limit)) if np.isfinite(limit) else "none"


def peaks_table(problem: Problem, signals: Signals) -> Table:
    """What every joint does at most, with the share of its limit."""
    rows = []
    told = [1, 2, 3, 4] if np.isfinite(signals.upper[Quantity.JERK]).any() else [1, 2, 4]
    for joint, name in enumerate(problem.robot.joint_names):
        q, unit = signals.values[0, :, joint], signals.units[joint][0]
        limits = f"{_bound(signals.lower[0, joint])} … {_bound(signals.upper[0, joint])}"
        peaks = {f"peak {_WORDS[order]}": _peak(signals, order, joint) for order in told}
        position = f"{in_figures(float(q.min()))} … {in_figures(float(q.max()))} {unit}"
        rows.append({"joint": name, "position": position, "limits": limits, **peaks})
    return Table.of(
        "Ranges and peaks of every joint",
        rows,
        left=("joint",),
        note="In brackets the share of the limit. Torques are those of the URDF's inertias.",
        folded=True,
    )


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
