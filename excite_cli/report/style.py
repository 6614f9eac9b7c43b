"""How figures look and how they are saved: palette, sizes, formats.

matplotlib is optional and is imported only when something is drawn. Figures are made without
pyplot, so drawing leaves no global state behind.
"""

import functools
import importlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from excite_cli.errors import MissingExtraError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito: told apart with every common form of colour blindness, and in grey print.
BLUE, VERMILION, GREEN, GREY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#767676", "#8A3F82"
FORBIDDEN, HELD_OUT = "#F3DCCB", "#EAEFF4"

WIDTH = 9.0  # [in]; shown 900 px wide, 9 pt text is 12 px high
_DOTS_PER_INCH = 180
_SETTINGS: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.titlesize": 11.0,
    "svg.hashsalt": "excite",
    "pdf.fonttype": 42,
}
# Nothing that changes from one run to the next, so that equal results give equal files.
_METADATA: dict[str, dict[str, Any]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}

P = ParamSpec("P")
T = TypeVar("T")


def matplotlib_part(name: str) -> Any:
    """The module `matplotlib.<name>`, or matplotlib itself for an empty name.

    Raises
    ------
    MissingExtraError
        matplotlib is not installed.
    """
    try:
        return importlib.import_module(f"matplotlib.{name}" if name else "matplotlib")
    except ImportError as error:
        raise MissingExtraError(
            "Figures need matplotlib, which is not installed. Run: pip install 'excite-cli[plot]'"
        ) from error


def styled(draw: Callable[P, T]) -> Callable[P, T]:
    """Run `draw` under the settings of this file, whatever the user's own are."""

    @functools.wraps(draw)
    def inner(*args: P.args, **kwargs: P.kwargs) -> T:
        library = matplotlib_part("")
        defaults = {k: v for k, v in library.rcParamsDefault.items() if "backend" not in k}
        with library.rc_context({**defaults, **_SETTINGS}):
            return draw(*args, **kwargs)

    return inner


def new_figure(height: float, constrained: bool = True) -> "Figure":
    """An empty figure as wide as a page and `height` [in] high."""
    figure: Figure = matplotlib_part("figure").Figure(
        figsize=(WIDTH, height), layout="constrained" if constrained else None
    )
    matplotlib_part("backends.backend_agg").FigureCanvasAgg(figure)
    return figure


def logarithmic(axes: "Axes", values: Iterable[float]) -> None:
    """Make the vertical axis logarithmic about `values`, with ticks that read as numbers."""
    ticker = matplotlib_part("ticker")
    shown = list(values)
    low, high = (min(shown), max(shown)) if shown else (1.0, 10.0)
    pad = max((high / low) ** 0.14, 1.5)
    axes.set_yscale("log")
    axes.set_ylim(low / pad, high * pad)
    subs = (1.0, 2.0, 5.0) if high / low < 1e3 else (1.0,)
    axes.yaxis.set_major_locator(ticker.LogLocator(subs=subs, numticks=50))
    axes.yaxis.set_minor_locator(ticker.NullLocator())
    axes.yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))


@styled
def save_figure(figure: "Figure", path: Path, kind: str) -> None:
    """Write `figure` as png, svg or pdf, whatever the suffix of `path`."""
    figure.savefig(path, format=kind, dpi=_DOTS_PER_INCH, metadata=_METADATA[kind])


@styled
def save_pages(figures: Iterable["Figure"], path: Path) -> None:
    """Write all `figures` as the pages of one PDF."""
    pages = matplotlib_part("backends.backend_pdf").PdfPages
    with pages(path, metadata=_METADATA["pdf"]) as file:
        for figure in figures:
            figure.savefig(file, format="pdf")
