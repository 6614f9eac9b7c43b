"""Charts of a page: matplotlib figures as SVG that takes its colours from the page.

A chart is drawn in stand-in colours; the SVG names them as variables of the page's style sheet,
so that one drawing serves light, dark and paper. Text stays text: it can be selected and searched,
and grows with the reader's own settings. Identifiers get the placeholder `PREFIX`, which the page
replaces, because several drawings in one page must not share any.
"""

import io
import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from excite_cli.report.style import matplotlib_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

# Stand-ins of the page's colours: no two alike, none that matplotlib uses by itself.
INK, MUTED, GRID, PAPER = "#0a0b0c", "#0a0b0d", "#0a0b0e", "#0a0b0f"
BLUE, VERMILION, GREEN, PURPLE = "#0a0c0c", "#0a0c0d", "#0a0c0e", "#0a0c0f"
FORBIDDEN, LIMIT = "#0a0d0c", "#0a0d0d"
SERIES = (BLUE, VERMILION, GREEN, PURPLE)
_VARIABLES = {
    INK: "ink", MUTED: "muted", GRID: "grid", PAPER: "card", BLUE: "blue", VERMILION: "vermilion",
    GREEN: "green", PURPLE: "purple", FORBIDDEN: "forbidden", LIMIT: "limit",
}  # fmt: skip

NARROW, WIDE = 3.95, 8.1  # [in]: one column of a page, also a phone's; and two
PREFIX = "chart-prefix-"
_SETTINGS: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.size": 8.5,
    "text.color": INK,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.labelsize": 8.5,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "figure.facecolor": "none",
    "svg.fonttype": "none",
    "text.parse_math": False,  # a dollar in a name is a dollar
    "svg.hashsalt": "excite",
    "path.simplify_threshold": 0.3,
}
_IDENTIFIER = re.compile(r'(\bid="|url\(#|xlink:href="#)')
_NUMBER = re.compile(r"(?<=[ML ])(-?\d+\.\d{2})\d+")


@dataclass(frozen=True)
class Chart:
    """A drawing of a page: SVG, its heading, and what one sees on it in words.

    `readout` (JSON) tells the page's script where axes and lines are, so that it can read values.
    """

    title: str
    svg: str
    alternative: str
    caption: str = ""
    wide: bool = False
    readout: str = ""


def draw_chart(
    title: str,
    alternative: str,
    draw: Callable[["Figure"], None],
    height: float = 2.3,
    wide: bool = False,
    caption: str = "",
    layout: tuple[float, float, float, float] | None = None,
) -> Chart:
    """Call `draw` with an empty figure of `height` [in], and keep what it drew as SVG.

    Parameters
    ----------
    title
        Heading of the card.
    alternative
        What the drawing shows, for those who do not see it: the finding, with its figures.
    draw
        Draws into the figure, in the colours of this file; axes carry labels with units.
    wide
        Two columns instead of one; such a chart scrolls sideways on a phone.
    layout
        Room [in] left, right, above and below the axes, for charts of which there are many;
        otherwise it is measured, which takes as long as drawing.

    Raises
    ------
    MissingExtraError
        matplotlib is not installed.
    """
    library = matplotlib_part("")
    defaults = {k: v for k, v in library.rcParamsDefault.items() if "backend" not in k}
    with library.rc_context({**defaults, **_SETTINGS}):
        width = WIDE if wide else NARROW
        figure = matplotlib_part("figure").Figure(
            figsize=(width, height), layout=None if layout else "constrained"
        )
        canvas = matplotlib_part("backends.backend_svg").FigureCanvasSVG(figure)
        if layout:
            left, right, top, bottom = layout
            figure.subplots_adjust(
                left / width, bottom / height, 1 - right / width, 1 - top / height, hspace=0.12
            )
        draw(figure)
        named = _named_lines(figure)
        buffer = io.StringIO()
        canvas.print_svg(buffer, metadata={"Date": None})  # savefig would draw twice
        readout = _readout(figure, named)
    return Chart(title, _inline(buffer.getvalue(), named), alternative, caption, wide, readout)


def _named_lines(figure: "Figure") -> dict[str, "Line2D"]:
    """Lines with a label, by the identifier that their drawing gets."""
    named: dict[str, Line2D] = {}
    for axes in figure.axes:
        for line in axes.lines:
            drawn = np.size(line.get_xdata()) > 1 and line.get_linestyle() != "None"
            if drawn and not str(line.get_label()).startswith("_"):
                name = f"line-{len(named) + 1}"
                line.set_gid(name)
                named[name] = line
    return named


def _readout(figure: "Figure", named: dict[str, "Line2D"]) -> str:
    """Where axes lie in the drawing [pt], what they span, and their lines; empty without lines."""
    width, height = (72.0 * inches for inches in figure.get_size_inches())
    found = []
    for axes in figure.axes:
        lines = [[name, str(line.get_label())] for name, line in named.items() if line.axes is axes]
        if not lines or axes.get_xscale() != "linear":
            continue
        place = axes.get_position()
        box = (place.x0 * width, (1 - place.y1) * height, place.width * width)
        found.append(
            {
                "box": [round(float(number), 2) for number in (*box, place.height * height)],
                "x": [float(end) for end in axes.get_xlim()],
                "y": [float(end) for end in axes.get_ylim()],
                "log": axes.get_yscale() == "log",
                "labels": [_shared_label(axes), axes.get_ylabel()],
                "lines": lines,
            }
        )
    return json.dumps(found, ensure_ascii=False) if found else ""


def _shared_label(axes: "Axes") -> str:
    """The label along the bottom, which only the lowest of axes that share it carries."""
    siblings = axes.get_shared_x_axes().get_siblings(axes)
    return next((each.get_xlabel() for each in siblings if each.get_xlabel()), "")


def _inline(text: str, names: Iterable[str]) -> str:
    """The `<svg>` element alone, with the page's colours and placeholders as identifiers.

    Of those only what is referred to and `names` are kept.
    """
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"\s*<!--.*?-->", "", svg, flags=re.DOTALL)
    # matplotlib's style element would hold for the whole page; the page's style sheet has its rule.
    svg = re.sub(r"<style.*?</style>", "", svg, flags=re.DOTALL)
    used = {*re.findall(r'(?:url\(#|xlink:href="#)([^")]*)', svg), *names}
    svg = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in used else "", svg)
    svg = re.sub(r"<defs>\s*</defs>", "", svg)
    svg = _IDENTIFIER.sub(lambda found: found[1] + PREFIX, svg)
    for colour, variable in _VARIABLES.items():
        svg = svg.replace(colour, f"var(--{variable})")
    svg = _NUMBER.sub(r"\1", svg)
    width, height = re.findall(r'(?:width|height)="([\d.]+)pt"', svg[:400])[:2]
    head = f'<svg viewBox="0 0 {width} {height}" xmlns:xlink="http://www.w3.org/1999/xlink">'
    return head + svg[svg.index(">") + 1 :].strip()


def time_axis(axes: "Axes", times: "Sequence[float] | NDArray[np.float64]") -> None:
    """Time in seconds along the bottom, from the first to the last of `times`."""
    axes.set_xlim(times[0], times[-1])
    axes.set_xlabel("time [s]", labelpad=2)


def few_ticks(axes: "Axes", across: int = 5, up: int = 4) -> None:
    """At most so many round ticks along each linear axis."""
    locator = matplotlib_part("ticker").MaxNLocator
    axes.xaxis.set_major_locator(locator(across, steps=(1, 2, 5, 10)))
    axes.yaxis.set_major_locator(locator(up, steps=(1, 2, 5, 10)))


def legend_below(figure: "Figure", columns: int = 3) -> None:
    """One legend for all axes, under them, where it covers nothing."""
    if any(axes.get_legend_handles_labels()[0] for axes in figure.axes):
        figure.legend(
            loc="outside lower center", ncols=columns, handlelength=1.6, columnspacing=1.2
        )


def thinned(count: int, most: int) -> slice:
    """Every k-th of `count` samples so that at most `most` remain: a page must stay light."""
    return slice(None, None, max(1, -(-count // most)))


def limits_about(values: Iterable[float], share: float = 0.08) -> tuple[float, float]:
    """Lower and upper end of an axis that shows all `values` with a little room."""
    shown = list(values)
    low, high = min(shown), max(shown)
    room = share * max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12)
    return low - room, high + room
