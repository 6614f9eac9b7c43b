"""On which quantities the residual depends, as a map and as pictures."""

from collections.abc import Sequence
from html import escape

import numpy as np

from excite_cli.diagnosis.covariate import Aspect, Covariate
from excite_cli.diagnosis.records import Diagnosis, ExcessResidual
from excite_cli.diagnosis.traces import Dependence, Traces
from excite_cli.diagnosis.words import covariate_in_words
from excite_cli.report.chart import Chart, Colour, limits_about
from excite_cli.report.plot import Curve, Panel, Plot, merged
from excite_cli.report.residual_chart import readable_unit
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Block, Charts, Text

# Shares in a grid: the larger, the darker, with the figure in each cell, as SVG.

_WIDTH, _WIDE = 284.0, 583.0  # pt
_ROW, _LETTER, _MOST_NAME, _EDGE = 15.0, 4.5, 130.0, 4.0  # pt
_SLOPE = np.radians(40.0)


def share_map(
    title: str,
    alternative: str,
    rows: Sequence[str],
    columns: Sequence[str],
    shares: Array,
    least: float,
    caption: str = "",
) -> Chart:
    """`shares` (rows, columns), from 0 to 1; cells below `least` are empty."""
    wide = len(columns) > 6
    width = _WIDE if wide else _WIDTH
    left = min(_MOST_NAME, _LETTER * max(map(len, rows)) + _EDGE)
    cell = (width - left - _EDGE) / len(columns)
    bottom = _EDGE + _ROW * len(rows)
    # Names of columns lean; the first must not leave the drawing on the left.
    room = min(_LETTER * max(map(len, columns)), (left + cell / 2) / np.cos(_SLOPE))
    height = bottom + 10.0 + room * np.sin(_SLOPE)
    parts = [f'<svg viewBox="0 0 {width:g} {height:.0f}">']
    for y, name in enumerate(rows):
        parts.append(_text(left - 4, _EDGE + _ROW * (y + 0.5) + 3, name, "end", left - 4))
        for x, share in enumerate(shares[y]):
            if not share >= least:  # nor what is not known
                continue
            opacity = 0.08 + 0.5 * float(np.sqrt(share))
            parts.append(
                f'<rect x="{left + cell * x + 1:.1f}" y="{_EDGE + _ROW * y + 1:.1f}" '
                f'width="{cell - 2:.1f}" height="{_ROW - 2:.1f}" '
                f'style="fill: var(--blue); opacity: {opacity:.2f}"></rect>'
            )
            middle = left + cell * (x + 0.5)
            figure = f"{100 * share:.0f}"
            parts.append(_text(middle, _EDGE + _ROW * (y + 0.5) + 3, figure, "middle", cell))
    for x, name in enumerate(columns):
        middle = left + cell * (x + 0.5)
        turn = f' transform="rotate(-40 {middle:.1f} {bottom + 8:.1f})"'
        parts.append(_text(middle, bottom + 8, name, "end", room, turn))
    return Chart(title, "".join([*parts, "</svg>"]), alternative, caption, wide)


def _text(x: float, y: float, text: str, anchor: str, room: float, turn: str = "") -> str:
    fits = _LETTER * len(text) <= room + 1.0
    narrow = "" if fits else f' textLength="{room:.0f}" lengthAdjust="spacingAndGlyphs"'
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{narrow}{turn} '
        f'style="font-size: 8.5px; fill: var(--ink)">{escape(text)}</text>'
    )


_SHOWN = 0.01  # share from which on a quantity gets a line of the map
_MOST_ROWS = 18
_MOST_DOTS = 400
_UNITS = {"position": "rad", "speed": "rad/s", "acceleration": "rad/s²", "load": "N·m", "time": "s"}
# Where a trace has it.
_SERIES = {"position": "q", "speed": "v", "acceleration": "a", "load": "load", "time": "t"}


def dependence_blocks(found: Diagnosis) -> list[Block]:
    """What is left over what it depends on most, and the map."""
    if found.traces is None:
        return []
    pictures = tuple(
        chart
        for each in found.unexplained
        for covariate in each.depends_on
        for chart in _picture(found, found.traces, each, covariate)
    )
    title = "Residual over the quantities on which the residual depends"
    return [*([Charts(pictures, title)] if pictures else []), _map(found.traces.dependence)]


def _map(dependence: Dependence) -> Block:
    most = dependence.shares.max(axis=0)
    rows = [int(k) for k in np.argsort(-most, kind="stable")[:_MOST_ROWS] if most[k] >= _SHOWN]
    if not rows:
        return Text(
            f"No smooth function of a single quantity predicts {_SHOWN:.0%} or more of the "
            "residual of any joint that runs left out confirm."
        )
    j = int(np.argmax(dependence.shares[:, rows[0]]))
    words = (
        f"Of {len(dependence.quantities)} quantities, {len(rows)} explain {_SHOWN:.0%} or more of "
        f"the residual of some joint, at most {most[rows[0]]:.0%}: "
        f"{covariate_in_words(dependence.quantities[rows[0]])} for {dependence.joints[j]}."
    )
    chart = share_map(
        "Share of the residual that one quantity explains [%]",
        words,
        [covariate_in_words(dependence.quantities[k]) for k in rows],
        dependence.joints,
        dependence.shares[:, rows].T,
        _SHOWN / 2,
        "Columns: the joint of the residual. Shares are cross-validated over runs; shares overlap, "
        "since quantities of one motion correlate. The sentences above name the significant ones.",
    )
    return Charts((chart,))


def _picture(
    found: Diagnosis, traces: Traces, rest: ExcessResidual, covariate: Covariate
) -> list[Plot]:
    """What is left of the joint over the covariate; nothing if too few samples are known."""
    if covariate.quantity not in _SERIES:
        return []  # of columns of the log no trace is kept
    timed = covariate.quantity == "time"
    names = list(found.joint_names)
    j = names.index(rest.joint)
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
        f"Residual torque of {rest.joint}, over the {axis}: means reach "
        f"{largest:.3g} {unit}, the RMS of all is "
        f"{np.sqrt(np.mean(left[known] ** 2)):.3g} {unit}."
    )

    factor, scaled = readable_unit(unit, float(np.quantile(np.abs(left[known]), 0.98)))
    dots = np.random.default_rng(0).permutation(np.flatnonzero(known))[:_MOST_DOTS]
    at, (samples, *middles) = merged(
        (x[dots], left[dots]), *((center, middle) for _, center, middle in means)
    )
    colours: tuple[Colour, ...] = ("vermilion", "blue")
    shown = [np.quantile(left[known], [0.005, 0.995]), *(middle for _, _, middle in means)]
    panel = Panel(
        f"residual [{scaled}]",
        (
            Curve("residual", factor * samples, "muted", "dots"),
            *(
                Curve(f"mean {label}".strip(), factor * own, colour, "joined")
                for colour, (label, _, _), own in zip(colours, means, middles, strict=False)
            ),
        ),
        span=limits_about(factor * np.concatenate(shown)),
        height=210,
    )
    title = f"{rest.joint}: residual, over {covariate_in_words(covariate)}"
    return [Plot(title, words, axis, at, (panel,))]


def _means(x: Array, y: Array) -> tuple[Array, Array]:
    order = np.argsort(x, kind="stable")
    bins = np.array_split(order, int(np.clip(len(x) // 12, 2, 24)))
    return (
        np.array([np.median(x[own]) for own in bins]),
        np.array([np.mean(y[own]) for own in bins]),
    )
