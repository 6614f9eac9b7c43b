"""Shares in a grid: the larger, the darker, with the figure in each cell, as SVG."""

from collections.abc import Sequence
from html import escape

import numpy as np

from excite_cli.report.chart import Chart
from excite_cli.robot.model import Array

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
