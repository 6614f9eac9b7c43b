"""Pictures of a record in matplotlib, for people at work: what `found.plot_residual()` draws.

Unlike those of a page they are made with pyplot, so that a notebook and `plt.show()` show them.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ConfigError, nearest
from excite_cli.excitation.result import Result
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.report.effect_chart import Cloud, binned, law_line
from excite_cli.report.plot import Panel, Plot
from excite_cli.report.plot_figure import (
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    HELD_OUT,
    PURPLE,
    VERMILION,
    WIDTH,
    matplotlib_part,
    styled,
)
from excite_cli.report.residual_chart import plots_in_time, readable_unit, torque_or_force
from excite_cli.robot.model import Array, build_robot
from excite_cli.trajectory.catalogue import build_trajectory

_DOTS: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 2.5, "color": GREY}
_LINES = (BLUE, VERMILION, GREEN, PURPLE, "black", "#B8860B")
_STYLES = ("-", (0, (4, 1.5)), (0, (1, 1)))
_INSTANTS = 600


def chosen_joints(joint: str | None, joints: Sequence[str], ax: Any) -> list[str]:
    """The joint that is named; all of them, if there is room for more than one.

    Raises
    ------
    ConfigError
        There is no such joint, or one axes for several.
    """
    if joint is None and ax is not None and len(joints) > 1:
        raise ConfigError(f"ax is one joint's. Name it: {', '.join(joints)}.")
    if joint is not None and joint not in joints:
        raise ConfigError(
            f"joint '{joint}' has no such plot.{nearest(joint, joints)} Joints: "
            f"{', '.join(joints) or 'none'}."
        )
    return list(joints) if joint is None else [joint]


@styled
def plot_residual(
    traces: Sequence[TorqueTrace],
    units: Mapping[str, str],
    joint: str | None,
    ax: Any,
) -> Any:
    """Torque and its residual in time, a row per joint, of the first run; in `ax` residual alone.

    `units` of the torques by all joints.
    """
    if not traces:
        raise ConfigError("No torque over time is kept in this record. Make it anew.")
    known = np.any([np.isfinite(trace.measured).any(axis=0) for trace in traces], axis=0)
    names = [name for name, measured in zip(units, known, strict=True) if measured]
    wanted = chosen_joints(joint, names, ax)
    label, plots = next(iter(plots_in_time(traces, [*units], [*units.values()]).items()))
    rows = [plot for plot in plots if plot.title in wanted]
    if ax is not None:
        _panel(ax, rows[0], rows[0].panels[1], rows[0].title)
        ax.set_xlabel(rows[0].axis)
        return ax
    pyplot = matplotlib_part("pyplot")
    figure, axes = pyplot.subplots(
        len(rows), 2, figsize=(WIDTH, 0.9 + 1.35 * len(rows)), sharex="col", squeeze=False,
        layout="constrained",
    )  # fmt: skip
    for pair, row in zip(axes, rows, strict=True):
        for each, panel in zip(pair, row.panels, strict=True):
            _panel(each, row, panel, row.title if panel is row.panels[0] else "")
    for each in axes[-1]:
        each.set_xlabel(rows[0].axis)
    shaded = "; shaded: held out" if rows[0].shaded else ""
    figure.suptitle(f"{label}{shaded}", x=0.01, ha="left", fontsize=9)
    return axes


def _panel(ax: Any, plot: Plot, panel: Panel, title: str = "") -> None:
    """The first of several series as dots behind, the last thin on top; names in their colours."""
    for low, high in plot.shaded:
        ax.axvspan(low, high, color=HELD_OUT, linewidth=0)
    for series in panel.series:
        behind = series is not panel.series[-1]
        look = _DOTS if behind else {"color": COLOURS[series.colour], "linewidth": 0.8}
        ax.plot(plot.x, series.y, **look)
    ax.set_ylabel(panel.axis)
    ax.margins(x=0.01)
    _words(ax, title, [(series.label, COLOURS[series.colour]) for series in panel.series])


def _words(ax: Any, title: str, words: Sequence[tuple[str, str]] = ()) -> None:
    """A title and words in their colours, side by side above the axes."""
    last: Any = None
    for text, colour, weight in ((title, "black", "bold"), *((*each, "normal") for each in words)):
        place: dict[str, Any] = {"xy": (0, 1), "xycoords": "axes fraction", "xytext": (0, 3)}
        if last is not None:
            place = {"xy": (1, 0), "xycoords": last, "xytext": (9, 0)}
        if text:
            last = ax.annotate(
                text, textcoords="offset points", color=colour, fontsize=8.5, weight=weight,
                va="bottom", annotation_clip=False, **place,
            )  # fmt: skip


@styled
def plot_friction(cloud: Cloud, joint: str, ax: Any) -> Any:
    """What all else leaves of the torque as dots and their middle 80 %, and the law on top."""
    factor, unit = readable_unit(cloud.unit, float(np.quantile(np.abs(cloud.partial), 0.98)))
    if ax is None:
        _, ax = matplotlib_part("pyplot").subplots(figsize=(5.4, 3.4), layout="constrained")
    center, _, low, high = binned(cloud)
    for side in (center < 0, center >= 0):  # friction jumps at zero
        band = factor * np.stack([low, high])[:, side]
        ax.fill_between(center[side], *band, color=GREY, alpha=0.25, linewidth=0)
    most = np.random.default_rng(0).permutation(len(cloud.x))[:1500]
    ax.plot(cloud.x[most], factor * cloud.partial[most], **{**_DOTS, "alpha": 0.5})
    x, law = law_line(cloud)
    ax.plot(x, factor * law, color=VERMILION, linewidth=1.2)
    shown = factor * np.quantile(cloud.partial, [0.002, 0.998])
    ax.set_ylim(*(shown + 0.08 * np.ptp(shown) * np.array([-1, 1])))
    ax.set_xlabel(cloud.axis)
    ax.set_ylabel(f"friction {torque_or_force(unit)} [{unit}]")
    _words(ax, joint, [("measured, less all else", GREY), ("identified law", VERMILION)])
    return ax


@styled
def plot_motion(result: Result, motion: int | None, ax: Any) -> Any:
    """Positions, speeds and accelerations of all joints in time; in `ax` positions alone."""
    there = {each.index: each for each in result.motions}
    if not there or (motion is not None and motion not in there):
        raise ConfigError(
            f"there is no motion {motion or 'to plot'}. Motions: "
            f"{', '.join(map(str, there)) or 'none'}."
        )
    chosen = there[max(there) if motion is None else motion]
    spec = parse_spec(result.config, "the config stored in the result")
    sliding = build_robot(spec.robot, Path(result.config_folder)).sliding
    trajectory = build_trajectory(spec.trajectory)
    t = np.linspace(0.0, trajectory.duration, _INSTANTS)
    states = trajectory.states(t, chosen.coefficients)
    unit = " or ".join(u for u, some in (("rad", ~sliding), ("m", sliding)) if some.any())
    axes = [ax]
    if ax is None:
        _, axes = matplotlib_part("pyplot").subplots(
            3, 1, figsize=(WIDTH, 6.4), sharex=True, layout="constrained",
            gridspec_kw={"height_ratios": [1.5, 1, 1]},
        )  # fmt: skip
    words = (("position", ""), ("speed", "/s"), ("acceleration", "/s²"))
    for each, x, (word, per) in zip(axes, states, words, strict=False):
        told = " or ".join(f"{u}{per}" for u in unit.split(" or "))
        for j in range(len(result.joint_names)):
            each.plot(t, x[:, j], linewidth=1.0, **_look(j))
        each.set_ylabel(f"{word} [{told}]")
        each.margins(x=0.0)
    _at_the_end(axes[0], result.joint_names, states[0])
    _words(axes[0], f"motion {chosen.index}")
    axes[-1].set_xlabel("time [s]")
    return ax if ax is not None else axes


def _look(j: int) -> dict[str, Any]:
    style = _STYLES[j // len(_LINES) % len(_STYLES)]
    return {"color": _LINES[j % len(_LINES)], "linestyle": style}


def _at_the_end(ax: Any, names: Sequence[str], x: Array) -> None:
    """Names of lines beside their ends (n,), apart from each other."""
    low, high = ax.get_ylim()
    step = (high - low) * 0.075
    order = np.argsort(x[-1])
    places = x[-1, order].astype(float)
    for k in range(1, len(places)):
        places[k] = max(places[k], places[k - 1] + step)
    places -= max(0.0, 0.5 * float(places[-1] - x[-1].max()))
    for place, j in zip(places, order.tolist(), strict=True):
        ax.annotate(
            names[j], (1, place), xycoords=("axes fraction", "data"), xytext=(5, 0),
            textcoords="offset points", va="center", fontsize=8, color=_look(j)["color"],
            annotation_clip=False,
        )  # fmt: skip
