"""Charts that answer to the mouse: numbers for the page's script, which draws them with uPlot.

Nothing is drawn here: a chart costs no more than its numbers. They are told in 65,533 steps of
each series' range, two bytes each, which no screen resolves.
"""

import base64
import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from excite_cli.report.chart import Colour
from excite_cli.robot.model import Array

Look = Literal["line", "band", "dashed", "dotted", "joined", "steps", "dots", "marks", "rings"]

_STEPS = 65533  # of two bytes; two values are kept
_GAP, _ABSENT = -32768, 32767
_LINE, _AXIS = 20, 34  # px, of text above a panel


@dataclass(frozen=True)
class Curve:
    """One quantity over the chart's x: `y` (T,), NaN where a line is to be broken.

    Infinite where it has no point of its own: a line goes on there. `low`, `high` (T,): ends of a
    whisker at each point. `joined` is a line with its points, `steps` keeps each value to
    the next, `band` is broad and pale.
    """

    label: str
    y: Array
    colour: Colour
    look: Look = "line"
    low: Array | None = None
    high: Array | None = None


@dataclass(frozen=True)
class Panel:
    """Series over one vertical axis, `axis` its label with unit; the first are behind the others.

    `span`: what the axis shows; without, what its series need. Below and above `limits` (infinite:
    none) it is shaded as forbidden; within ± `noise` (0: unknown) as what says nothing. `corner`:
    a figure that sums it up. On a `logarithmic` axis values must be above 0.
    """

    axis: str
    series: tuple[Curve, ...]
    span: tuple[float, float] | None = None
    limits: tuple[float, float] = (-np.inf, np.inf)
    height: int = 150
    logarithmic: bool = False
    noise: float = 0.0
    corner: str = ""


@dataclass(frozen=True)
class Plot:
    """Panels under each other over one `x` (T,), which increases; `axis` its label with unit.

    `alternative` says in words what one sees, for those who do not. Charts of one `link` are
    zoomed together and share the cursor. `shaded`: spans of x on another ground. `counted`: x are
    whole numbers.
    """

    title: str
    alternative: str
    axis: str
    x: Array
    panels: tuple[Panel, ...]
    link: str = ""
    caption: str = ""
    wide: bool = False
    shaded: tuple[tuple[float, float], ...] = ()
    span: tuple[float, float] | None = None
    counted: bool = False

    @property
    def room(self) -> int:
        """Height [px] that it will take, so that nothing moves when it is drawn."""
        lines = sum(1 if len(panel.series) < 3 else 2 for panel in self.panels)
        return sum(panel.height for panel in self.panels) + lines * _LINE + _AXIS

    @property
    def data(self) -> str:
        """JSON for the page's script."""
        return json.dumps(
            {
                "axis": self.axis,
                "x": encoded(self.x),
                "span": self.span,
                "shaded": self.shaded,
                "link": self.link,
                "counted": self.counted,
                "panels": [_panel(panel) for panel in self.panels],
            },
            ensure_ascii=False,
            separators=(",", ":"),
        )


def encoded(values: Array) -> dict[str, Any]:
    """Least value, step, and multiples of it from −32767 on, base64, with gaps and absent ones."""
    known = np.isfinite(values)
    low, high = (float(end(values[known])) if known.any() else 0.0 for end in (np.min, np.max))
    step = (high - low) / _STEPS or 1.0
    whole = np.where(np.isnan(values), _GAP, _ABSENT).astype("<i2")
    whole[known] = np.rint((values[known] - low) / step) - 32767
    text = base64.b64encode(whole.tobytes()).decode("ascii")
    return {"lo": float(f"{low:.9g}"), "step": float(f"{step:.9g}"), "d": text}


def merged(
    *parts: tuple[Array, Array],
) -> tuple[Array, tuple[Array, ...]]:
    """One x for points (x, y) in any order: all x, and every y, infinite where it is absent."""
    x = np.concatenate([each for each, _ in parts])
    owner = np.repeat(np.arange(len(parts)), [len(each) for each, _ in parts])
    order = np.argsort(x, kind="stable")
    values = np.concatenate([y for _, y in parts])[order]
    owner = owner[order]
    return x[order], tuple(np.where(owner == k, values, np.inf) for k in range(len(parts)))


def _panel(panel: Panel) -> dict[str, Any]:
    finite = [x if np.isfinite(x) else None for x in panel.limits]
    return {
        "axis": panel.axis,
        "span": panel.span,
        "limits": finite,
        "noise": float(f"{panel.noise:.4g}"),
        "corner": panel.corner,
        "height": panel.height,
        "logarithmic": panel.logarithmic,
        "series": [_series(each, panel.logarithmic) for each in panel.series],
    }


def _series(series: Curve, logarithmic: bool) -> dict[str, Any]:
    told: dict[str, Any] = {
        "label": series.label,
        "colour": series.colour,
        "look": series.look,
        "y": encoded(np.log10(series.y) if logarithmic else series.y),
    }
    if series.low is not None and series.high is not None:
        told |= {"low": encoded(series.low), "high": encoded(series.high)}
    return told
