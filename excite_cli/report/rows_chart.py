"""Values in rows: a line for every name, with marks and bars along one axis, as SVG.

In the colours of the page's style sheet, so that one drawing serves light, dark and paper; text
stays text. A mark tells its value under the pointer.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from math import ceil, floor, log10
from typing import Literal

from excite_cli.report.chart import Chart, Colour, limits_about

Form = Literal["dot", "ring", "cross", "tick"]

_WIDTH, _ROW, _EDGE = 284.0, 15.0, 6.0  # pt
_LETTER, _MOST_NAME, _NOTE = 4.5, 140.0, 36.0  # pt
_BELOW = 28.0  # pt, for ticks and the axis' label
_LINE = 14.0  # pt of a line of the legend
_FEW_DECADES, _SOME_DECADES = 2.5, 6.0


@dataclass(frozen=True)
class Mark:
    """A value; `word` says what it is in the legend and under the pointer."""

    x: float
    word: str
    colour: Colour
    form: Form = "dot"


@dataclass(frozen=True)
class Bar:
    """A stretch of the axis; one with a `word` is in the legend."""

    low: float
    high: float
    colour: Colour
    width: float = 1.2
    opacity: float = 1.0
    dashed: bool = False
    word: str = ""


@dataclass(frozen=True)
class Row:
    """One name with what is drawn on its line; `note` stands behind it."""

    name: str
    marks: tuple[Mark, ...]
    bars: tuple[Bar, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class RowsChart(Chart):
    """A drawing of rows, with what it was drawn of."""

    axis: "Axis" = field(kw_only=True)
    rows: tuple[Row, ...] = field(kw_only=True)


@dataclass(frozen=True)
class Axis:
    """From `low` to `high`: linear, logarithmic, or that to both sides of ±`linear`."""

    label: str
    low: float
    high: float
    logarithmic: bool = False
    linear: float | None = None
    ticks: tuple[float, ...] = field(default=())

    @classmethod
    def logarithmic_about(cls, label: str, values: Sequence[float]) -> "Axis":
        """An axis with room for all values, which are above zero, and a tick on either side."""
        low, high = min(values) / 1.15, max(values) * 1.15
        if high / low < 4.0:
            middle = (low * high) ** 0.5
            low, high = min(low, middle / 2.0), max(high, middle * 2.0)
        wide = log10(high / low)
        times = (1.0, 2.0, 5.0) if wide < _FEW_DECADES else (1.0,)
        powers = range(floor(log10(low)), ceil(log10(high)) + 1, max(1, ceil(wide / _SOME_DECADES)))
        ticks = [each * 10.0**power for power in powers for each in times]
        return cls(label, low, high, True, ticks=tuple(t for t in ticks if low <= t <= high))

    @classmethod
    def about(cls, label: str, values: Sequence[float], linear: float | None = None) -> "Axis":
        """One with room for all values; with `linear` decades begin at ±that."""
        low, high = limits_about(values)
        largest = max(abs(low), abs(high))
        if linear is None or largest < 30 * linear:
            return cls(label, low, high, ticks=_even(low, high))
        decades = range(ceil(log10(linear) - 1e-9), floor(log10(largest) + 1e-9) + 1)
        every = [10.0**power for power in decades][:: 1 + (len(decades) > 3)]
        below = [-each for each in reversed(every[-2:])] if low < -linear else []
        ticks = [t for t in (*below, 0.0, *every) if low <= t <= high]
        return cls(label, low, high, linear=linear, ticks=tuple(ticks))

    def share(self, x: float) -> float:
        """Where x lies along the axis, from 0 to 1."""
        low, here, high = (self._placed(each) for each in (self.low, x, self.high))
        return (here - low) / (high - low)

    def _placed(self, x: float) -> float:
        if self.logarithmic:
            return log10(x)
        if self.linear is None or abs(x) <= self.linear:
            return x / (self.linear or 1.0)
        size = 1.0 + log10(abs(x) / self.linear)
        return size if x > 0 else -size


def _even(low: float, high: float) -> tuple[float, ...]:
    """Three to six multiples of 1, 2 or 5 times a power of ten."""
    least = (high - low) / 5.0
    ten = 10.0 ** floor(log10(least))
    step = next((each * ten for each in (1.0, 2.0, 5.0, 10.0) if each * ten >= least), 10.0 * ten)
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return tuple(k * step for k in range(first, last + 1))


def rows_chart(
    title: str,
    alternative: str,
    axis: Axis,
    rows: Sequence[Row],
    caption: str = "",
    noted: str = "",
) -> RowsChart:
    """The rows from above downwards; `noted` is the heading of the notes."""
    left = min(_MOST_NAME, _LETTER * max((len(row.name) for row in rows), default=0) + _EDGE)
    right = _WIDTH - _EDGE - (_NOTE if any(row.note for row in rows) else 0.0)
    top = _EDGE + (_ROW if noted else 0.0)
    bottom = top + _ROW * len(rows)
    legend, below = _legend(rows, bottom + _BELOW)

    def at(x: float) -> float:
        return left + (right - left) * min(max(axis.share(x), 0.0), 1.0)

    parts = [f'<svg viewBox="0 0 {_WIDTH:g} {below + 4:.0f}">']
    free = -_WIDTH  # where the next figure may begin; of two that are too close the first stands
    for tick in axis.ticks:
        figure = f"{tick:.6g}"
        half = _LETTER * len(figure) / 2
        parts.append(_path(f"M{at(tick):.1f} {top:.1f}V{bottom:.1f}", "grid", 0.7))
        if at(tick) - half >= free:
            parts.append(_text(at(tick), bottom + 10, figure, "middle"))
            free = at(tick) + half + _LETTER
    parts.append(_path(f"M{left:.1f} {bottom:.1f}H{right:.1f}", "muted", 0.7))
    parts.append(_text((left + right) / 2, bottom + 22, axis.label, "middle"))
    if noted:
        parts.append(_text(right + 3, top - 4, noted, "start"))
    for number, row in enumerate(rows):
        y = top + _ROW * (number + 0.5)
        parts.append(_text(left - 4, y + 3, row.name, "end", left - 4))
        for bar in row.bars:
            line = f"M{at(bar.low):.1f} {y:.1f}H{at(bar.high):.1f}"
            parts.append(_path(line, bar.colour, bar.width, bar.opacity, bar.dashed))
        for mark in row.marks:
            told = f"{row.name}, {mark.word} {mark.x:.4g}"
            parts.append(_drawn(mark, at(mark.x), y, told))
        if row.note:
            parts.append(_text(right + 3, y + 3, row.note, "start"))
    svg = "".join([*parts, *legend, "</svg>"])
    return RowsChart(title, svg, alternative, caption, axis=axis, rows=tuple(rows))


def _legend(rows: Sequence[Row], top: float) -> tuple[list[str], float]:
    """Every word once with its form, and where the lines of the legend end."""
    marks = {mark.word: mark for row in rows for mark in row.marks}
    bars = {bar.word: bar for row in rows for bar in row.bars if bar.word}
    parts, x, y = [], _EDGE, top + _LINE / 2
    for word in (*marks, *bars):
        width = 16.0 + _LETTER * len(word)
        if x > _EDGE and x + width > _WIDTH:
            x, y = _EDGE, y + _LINE
        if word in marks:
            parts.append(_drawn(marks[word], x + 4, y, word))
        else:
            bar = bars[word]
            line = f"M{x:.1f} {y:.1f}h8"
            parts.append(_path(line, bar.colour, bar.width, bar.opacity, bar.dashed))
        parts.append(_text(x + 12, y + 3, word, "start"))
        x += width + 4.0
    return parts, y + _LINE / 2


def _drawn(mark: Mark, x: float, y: float, told: str) -> str:
    colour, title = f"var(--{mark.colour})", f"<title>{escape(told)}</title>"
    if mark.form == "cross":
        line = f"M{x - 3:.1f} {y - 3:.1f}l6 6M{x - 3:.1f} {y + 3:.1f}l6 -6"
        return f"<g>{title}{_path(line, mark.colour, 1.4)}</g>"
    if mark.form == "tick":
        line = f"M{x:.1f} {y - 4.5:.1f}v9"
        return f"<g>{title}{_path(line, mark.colour, 2.0)}</g>"
    fill = colour if mark.form == "dot" else "var(--card)"
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" style="fill: {fill}; stroke: {colour}; '
        f'stroke-width: 1.3">{title}</circle>'
    )


def _path(line: str, colour: str, width: float, opacity: float = 1.0, dashed: bool = False) -> str:
    more = (f"; opacity: {opacity:g}" if opacity < 1.0 else "") + (
        "; stroke-dasharray: 3 2" if dashed else ""
    )
    return (
        f'<path d="{line}" style="stroke: var(--{colour}); stroke-width: {width:g}{more}"></path>'
    )


def _text(x: float, y: float, text: str, anchor: str, room: float | None = None) -> str:
    """Text, narrowed where it is longer than `room` [pt]."""
    fits = room is None or _LETTER * len(text) <= room
    narrow = "" if fits else f' textLength="{room:.0f}" lengthAdjust="spacingAndGlyphs"'
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{narrow} '
        f'style="font-size: 8.5px; fill: var(--ink)">{escape(text)}</text>'
    )
