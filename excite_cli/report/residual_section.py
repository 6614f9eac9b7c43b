"""Torque over time, run by run: what was measured, what the model says, what is left."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.report.chart import (
    BLUE,
    FORBIDDEN,
    MUTED,
    VERMILION,
    Chart,
    draw_chart,
    few_ticks,
    thinned,
    time_axis,
)
from excite_cli.report.page import Block, Charts, Choice, Text
from excite_cli.report.residual_unit import readable_unit, torque_or_force
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LAYOUT = 0.66, 0.08, 0.08, 0.6  # [in] left, right, above and below the axes
# Points of all lines together, and of one line at most and at least: the page must stay light.
_BUDGET, _MOST, _FEWEST = 240_000, 700, 150


def residuals_in_time(
    traces: Sequence[TorqueTrace], joint_names: Sequence[str], units: Sequence[str]
) -> tuple[Block, ...]:
    """A card per joint, a choice of runs; parts that took no part in the fit are shaded."""
    if not traces:
        return (
            Text(
                "The file holds no torque over time: it was written by an earlier version. Run "
                "the command again to have it."
            ),
        )
    runs: dict[str, list[TorqueTrace]] = {}
    for trace in traces:
        runs.setdefault(trace.run, []).append(trace)
    per_line = _BUDGET // (4 * len(joint_names) * len(runs))
    points = min(max(per_line, _FEWEST), _MOST)
    options = []
    for run, parts in runs.items():
        ordered = sorted(parts, key=lambda part: float(part.t[0]))
        charts = tuple(
            _card(ordered, j, name, unit, points)
            for j, (name, unit) in enumerate(zip(joint_names, units, strict=True))
        )
        options.append((_label(run, parts), (Charts(charts),)))
    if len(options) == 1:
        return options[0][1]
    return (Choice("Run", tuple(options)),)


def _label(run: str, parts: Sequence[TorqueTrace]) -> str:
    if all(part.sealed for part in parts):
        return f"{run} (sealed: took no part in the fit)"
    return run


def _card(parts: Sequence[TorqueTrace], j: int, name: str, unit: str, points: int) -> Chart:
    left = [part.measured[:, j] - part.predicted[:, j] for part in parts]
    before = [part.measured[:, j] - part.before[:, j] for part in parts if part.before is not None]
    words = f"Torque of {name}, measured with RMS {_rms([p.measured[:, j] for p in parts])} {unit}"
    words += f"; the model leaves RMS {_rms(left)} {unit}"
    if before:
        words += f", the declared model without the effects found {_rms(before)} {unit}"
    return draw_chart(
        name, f"{words}.", partial(_draw, parts, j, unit, points), height=3.0, layout=_LAYOUT
    )


def _rms(series: Sequence[Array]) -> str:
    whole = np.concatenate(list(series))
    whole = whole[np.isfinite(whole)]
    return f"{float(np.sqrt(np.mean(whole**2))):.3g}" if len(whole) else "unknown"


def _draw(parts: Sequence[TorqueTrace], j: int, unit: str, points: int, figure: "Figure") -> None:
    upper, lower = figure.subplots(2, 1, sharex=True)
    at = thinned(sum(len(part.t) for part in parts), points)
    mixed = {part.sealed for part in parts} == {False, True}
    factor, of_torque = readable_unit(unit, _largest([part.measured[at, j] for part in parts]))
    left = [part.measured[at, j] - part.predicted[at, j] for part in parts]
    before = [
        part.measured[at, j] - part.before[at, j] for part in parts if part.before is not None
    ]
    small, of_left = readable_unit(unit, _largest([*left, *before]))
    for number, part in enumerate(parts):
        t, labelled = part.t[at], number == 0
        upper.plot(t, factor * part.measured[at, j], color=MUTED, lw=1.0,
                   label="measured" if labelled else None)  # fmt: skip
        upper.plot(t, factor * part.predicted[at, j], color=BLUE, lw=1.0,
                   label="model" if labelled else None)  # fmt: skip
        if before:
            lower.plot(t, small * before[number], color=MUTED, lw=0.8, ls=(0, (3, 1.5)),
                       label="left before" if labelled else None)  # fmt: skip
        lower.plot(t, small * left[number], color=VERMILION, lw=1.0,
                   label="left" if labelled else None)  # fmt: skip
        if mixed and part.sealed:
            for axes in (upper, lower):
                axes.axvspan(part.t[0], part.t[-1], color=FORBIDDEN, lw=0, zorder=0)
    upper.set_ylabel(f"{torque_or_force(unit)} [{of_torque}]")
    lower.set_ylabel(f"left [{of_left}]")
    few_ticks(upper, up=3)
    few_ticks(lower, up=3)
    time_axis(lower, [float(parts[0].t[0]), float(parts[-1].t[-1])])
    upper.set_xlabel("")
    figure.align_ylabels()
    figure.legend(
        loc="lower center", ncols=4, handlelength=1.2, columnspacing=0.9, handletextpad=0.4,
        borderaxespad=0.1,
    )  # fmt: skip


def _largest(series: Sequence[Array]) -> float:
    whole = np.concatenate(list(series))
    return float(np.nanmax(np.abs(whole))) if np.isfinite(whole).any() else 1.0
