"""What is still unexplained: on which quantities the rest depends, as a map and as pictures."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.diagnosis.covariate import Aspect, Covariate
from excite_cli.diagnosis.records import Diagnosis, Unexplained
from excite_cli.diagnosis.traces import Dependence, Traces
from excite_cli.diagnosis.words import covariate_in_words, rests_in_words
from excite_cli.report.chart import (
    BLUE,
    INK,
    MUTED,
    VERMILION,
    Chart,
    draw_chart,
    few_ticks,
    legend_below,
    limits_about,
)
from excite_cli.report.effect_chart import LAYOUT
from excite_cli.report.page import Block, Charts, Section, Text
from excite_cli.report.residual_unit import readable_unit
from excite_cli.report.style import matplotlib_part
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHOWN = 0.01  # share from which on a quantity gets a line of the map
_MOST_ROWS = 18
_MOST_DOTS = 400
_UNITS = {"position": "rad", "speed": "rad/s", "acceleration": "rad/s²", "load": "N·m", "time": "s"}
# Where a trace has it.
_SERIES = {"position": "q", "speed": "v", "acceleration": "a", "load": "load", "time": "t"}


def dependence_section(found: Diagnosis) -> Section:
    """Sentences, the map, and what is left over what it depends on most."""
    sentences: list[Block] = [
        Text(
            f"The residual of {each.joint} still depends on {_joined(each.depends_on)} "
            f"({each.share_of_residual:.1%} of it); no effect of the catalogue has this form.",
            "bad",
        )
        for each in found.unexplained
    ]
    more, perhaps = rests_in_words(found, covariate_in_words)
    sentences += [*(Text(text, "bad") for text in more), *(Text(text) for text in perhaps)]
    if not sentences:
        sentences.append(
            Text(
                "No significant dependence on any quantity is left: what remains "
                "behaves like noise.",
                "good",
            )
        )
    blocks = sentences
    if found.traces is not None:
        pictures = [
            chart
            for each in found.unexplained
            for covariate in each.depends_on[:2]
            for chart in _picture(found, found.traces, each, covariate)
        ]
        if pictures:
            blocks.append(Charts(tuple(pictures), "What is left, over what it depends on"))
        blocks.append(_map(found.traces.dependence))
    lead = (
        "After all effects are in, is what remains of the torque still a function of something? "
        "Every joint's rest is tried against time, angles, speeds and accelerations of all joints, "
        "and its own load, direction and history."
    )
    return Section("diagnosis-unexplained", "What stays unexplained", tuple(blocks), lead)


def _joined(covariates: Sequence[Covariate]) -> str:
    words = [covariate_in_words(each) for each in covariates]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _map(dependence: Dependence) -> Block:
    most = dependence.shares.max(axis=0)
    rows = [int(k) for k in np.argsort(-most, kind="stable")[:_MOST_ROWS] if most[k] >= _SHOWN]
    if not rows:
        return Text(
            f"No smooth function of a single quantity takes {_SHOWN:.0%} or more off the rest of "
            "any joint that runs left out confirm."
        )
    j = int(np.argmax(dependence.shares[:, rows[0]]))
    words = (
        f"Of {len(dependence.quantities)} quantities, {len(rows)} explain {_SHOWN:.0%} or more of "
        f"the rest of some joint, at most {most[rows[0]]:.0%}: "
        f"{covariate_in_words(dependence.quantities[rows[0]])} for {dependence.joints[j]}."
    )
    wide = len(dependence.joints) > 6
    return draw_chart(
        "Share of the rest that one quantity explains [%]",
        words,
        partial(_draw_map, dependence, rows, wide),
        height=1.25 + 0.22 * len(rows),
        wide=wide,
        caption=(
            "Columns: the joint whose torque is left. A share counts as far as runs left out "
            "confirm it; shares overlap, since quantities of one motion do. Not every one is "
            "significant: the sentences above say which are."
        ),
    )


def _draw_map(dependence: Dependence, rows: Sequence[int], wide: bool, figure: "Figure") -> None:
    axes = figure.add_subplot()
    rectangle = matplotlib_part("patches").Rectangle
    for y, k in enumerate(rows):
        for x, share in enumerate(dependence.shares[:, k]):
            if share < _SHOWN / 2:
                continue
            alpha = 0.08 + 0.5 * float(np.sqrt(share))
            axes.add_patch(rectangle((x - 0.48, y - 0.46), 0.96, 0.92, fc=BLUE, alpha=alpha, lw=0))
            axes.text(x, y, f"{100 * share:.0f}", ha="center", va="center", fontsize=8, color=INK)
    axes.set_xlim(-0.5, len(dependence.joints) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(range(len(rows)), [covariate_in_words(dependence.quantities[k]) for k in rows])
    axes.set_xticks(range(len(dependence.joints)), dependence.joints, rotation=40, ha="right",
                    rotation_mode="anchor")  # fmt: skip
    axes.grid(visible=False)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)


def _picture(
    found: Diagnosis, traces: Traces, unexplained: Unexplained, covariate: Covariate
) -> list[Chart]:
    """What is left of the joint over the covariate; nothing if too few samples are known."""
    if covariate.quantity not in _SERIES:
        return []  # of columns of the log no trace is kept
    timed = covariate.quantity == "time"
    names = list(found.joint_names)
    j = names.index(unexplained.joint)
    k = names.index(covariate.joint) if covariate.joint in names else j
    left = np.concatenate([run.measured[:, j] - run.predicted[:, j] for run in traces.runs])
    series = [getattr(run, _SERIES[covariate.quantity]) for run in traces.runs]
    x = np.concatenate(series if timed else [each[:, k] for each in series])
    forward = np.concatenate([run.v[:, j] >= 0 for run in traces.runs])
    known = np.isfinite(left) & np.concatenate([run.counted[:, j] for run in traces.runs])
    unit = traces.torque_units[j]
    of_x = _UNITS[covariate.quantity]
    if traces.torque_units[k] == "N":
        of_x = of_x.replace("N·m", "N").replace("rad", "m")
    plain = Covariate(covariate.quantity, "" if timed else names[k])
    axis = f"{covariate_in_words(plain)} [{of_x}]"
    groups = [("", known)]
    if covariate.aspect is not Aspect.VALUE:
        groups = [("forwards", known & forward), ("backwards", known & ~forward)]
    means = [(label, *_means(x[at], left[at])) for label, at in groups if at.sum() >= 20]
    if not means:
        return []
    largest = max(float(np.abs(middle).max()) for _, _, middle in means)
    words = (
        f"What is left of the torque of {unexplained.joint}, over the {axis}: means reach "
        f"{largest:.3g} {unit}, the RMS of all is "
        f"{np.sqrt(np.mean(left[known] ** 2)):.3g} {unit}."
    )

    def draw(figure: "Figure") -> None:
        axes: Axes = figure.add_subplot()
        factor, scaled = readable_unit(unit, float(np.quantile(np.abs(left[known]), 0.98)))
        dots = np.random.default_rng(0).permutation(np.flatnonzero(known))[:_MOST_DOTS]
        axes.plot(
            x[dots], factor * left[dots], ".", color=MUTED, ms=3.6, alpha=0.6, mew=0, label="left"
        )
        for colour, (label, center, middle) in zip((VERMILION, BLUE), means, strict=False):
            axes.plot(center, factor * middle, "o-", color=colour, ms=3, lw=1.2,
                      label=f"mean {label}".strip())  # fmt: skip
        shown = [np.quantile(left[known], [0.005, 0.995]), *(middle for _, _, middle in means)]
        axes.set_ylim(*limits_about(factor * np.concatenate(shown)))
        axes.set_xlabel(axis, labelpad=2)
        axes.set_ylabel(f"left [{scaled}]")
        few_ticks(axes)
        legend_below(figure)

    return [draw_chart(f"{unexplained.joint}: left, over {covariate_in_words(covariate)}", words,
                       draw, height=2.5, layout=LAYOUT)]  # fmt: skip


def _means(x: Array, y: Array) -> tuple[Array, Array]:
    order = np.argsort(x, kind="stable")
    bins = np.array_split(order, int(np.clip(len(x) // 12, 2, 24)))
    return (
        np.array([np.median(x[own]) for own in bins]),
        np.array([np.mean(y[own]) for own in bins]),
    )
