"""Pictures of records in matplotlib, for people at work: what `found.plot_residual()` draws.

Unlike those of a page they are made with pyplot, so that a notebook and `plt.show()` show them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.config.load_spec import parse_spec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import ConfigError, nearest
from excite_cli.excitation.result import Result
from excite_cli.identification.identify import Identification
from excite_cli.report.effect_chart import Cloud, cloud_plot
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.report.plot_figure import HELD_OUT, WIDTH, draw_panel, matplotlib_part, styled
from excite_cli.report.residual_chart import plots_in_time
from excite_cli.robot.model import build_robot
from excite_cli.trajectory.catalogue import build_trajectory

_INSTANTS = 600


def _drawn(plots: Sequence[Plot], name: Any, ax: Any, alone: int, head: str = "") -> Any:
    """A row for the plot called `name`, or for each; in `ax` one of them: its panel `alone`."""
    titles = [plot.title for plot in plots]
    if name not in (None, *titles):
        raise ConfigError(
            f"There is no '{name}' to plot.{nearest(str(name), titles)} There are: "
            f"{', '.join(titles) or 'none'}."
        )
    rows = [plot for plot in plots if name in (None, plot.title)]
    if not rows or (ax is not None and len(rows) > 1):
        raise ConfigError(f"Nothing, or more than ax has room for. Name one of: {titles}.")
    if ax is not None:
        _panel(ax, rows[0], rows[0].panels[alone], rows[0].title)
        return ax
    shape = len(rows), len(rows[0].panels)
    size = (WIDTH, 0.9 + 1.35 * shape[0]) if shape != (1, 1) else (5.4, 3.4)
    figure, axes = matplotlib_part("pyplot").subplots(
        *shape, figsize=size, sharex="col", squeeze=False, layout="constrained"
    )
    for pair, row in zip(axes, rows, strict=True):
        for each, panel in zip(pair, row.panels, strict=True):
            _panel(each, row, panel, row.title * (panel is row.panels[0]))
    for each in axes[:-1].flat:
        each.set_xlabel("")
    figure.align_ylabels()
    if head:
        figure.suptitle(head, x=0.01, ha="left", fontsize=9)
    return axes if axes.size > 1 else axes[0, 0]


def _panel(ax: Any, plot: Plot, panel: Panel, title: str) -> None:
    """What was measured as dots behind, the last series thin on top; words in their colours."""
    for low, high in plot.shaded:
        ax.axvspan(low, high, color=HELD_OUT, linewidth=0, label="_")
    *others, top = panel.series
    behind = (each if each.low is not None else replace(each, look="dots") for each in others)
    draw_panel(ax, plot.x, replace(panel, series=(*behind, replace(top, look="line"))))
    ax.set(xlabel=plot.axis, ylabel=panel.axis, xlim=plot.span)
    ax.set_title(title, weight="bold")
    if others:
        ax.legend(
            loc="lower right", bbox_to_anchor=(1.02, 0.97), ncols=3, labelcolor="linecolor",
            handlelength=0.8, columnspacing=1.0,
        )  # fmt: skip


@styled
def plot_residual(found: Diagnosis | Identification, joint: str | None, ax: Any) -> Any:
    """Torque and its residual in time, of the first run; in `ax` residual alone."""
    if isinstance(found, Diagnosis):
        names, every = found.joint_names, found.traces.runs if found.traces else ()
        every = (*found.held_out_traces, *every)
    else:
        names = found.fit.joint_names
        every = tuple(sorted(found.traces, key=lambda trace: not trace.held_out))
    seen = np.any([np.isfinite(each.measured).any(axis=0) for each in every], axis=0)
    for label, plots in plots_in_time(every, names, found.torque_units).items():
        head = f"{label}; shaded: held out" if plots[0].shaded else label
        measured = [plot for plot, own in zip(plots, seen, strict=True) if own]
        return _drawn(measured, joint, ax, -1, head)
    raise ConfigError("No torque over time is kept in this record. Make it anew.")


@styled
def plot_friction(clouds: Mapping[str, tuple[Cloud, str]], joint: str, ax: Any) -> Any:
    """Of one joint what all else leaves of the torque, its middle 80 %, and the law on top."""
    return _drawn([cloud_plot(name, own) for name, (own, _) in clouds.items()], joint, ax, 0)


@styled
def plot_motion(result: Result, motion: int | None, joint: str | None, ax: Any) -> Any:
    """Position, speed and acceleration of joints in time; in `ax` position alone."""
    there = {each.index: each for each in result.motions}
    if not there or motion not in (None, *there):
        raise ConfigError(f"There is no motion {motion or ''} to plot. Motions: {[*there]}.")
    chosen = there[max(there) if motion is None else motion]
    spec = parse_spec(result.config, "the config stored in the result")
    sliding = build_robot(spec.robot, Path(result.config_folder)).sliding
    trajectory = build_trajectory(spec.trajectory)
    t = np.linspace(0.0, trajectory.duration, _INSTANTS)
    words = (("position", ""), ("speed", "/s"), ("acceleration", "/s²"))
    states = [*zip(words, trajectory.states(t, chosen.coefficients), strict=True)]
    plots = [
        Plot(name, "", "time [s]", t, tuple(
            Panel(f"{word} [{'m' if sliding[j] else 'rad'}{per}]", (Curve(word, x[:, j], "blue"),))
            for (word, per), x in states
        ))
        for j, name in enumerate(result.joint_names)
    ]  # fmt: skip
    return _drawn(plots, joint, ax, 0, f"motion {chosen.index}")
