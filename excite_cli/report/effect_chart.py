"""The evidence for an effect: the torque that everything else leaves, and the law over it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.diagnosis.traces import EffectTrace
from excite_cli.report.chart import limits_about
from excite_cli.report.plot import Curve, Panel, Plot, merged
from excite_cli.report.residual_chart import readable_unit, torque_or_force

PREDICTED = "torque that the effect predicts"
_MOST_DOTS = 260
_WINDOW = 2.0  # s
_NO_FUNCTION = 0.08  # mean spread of the law over a narrow range of x, of its whole range
_STEP_AT_ZERO = 0.25  # of the law's range: it is drawn as a step


@dataclass(frozen=True)
class Cloud:
    """Samples of one effect on one joint: over `x`, what is left for the law, and the law.

    `axis` names x with its unit; `unit` that of the torque; with `diagonal`, x is the law itself.
    """

    axis: str
    unit: str
    x: Array
    partial: Array
    law: Array
    period: float | None = None
    diagonal: bool = False

    @property
    def explained(self) -> float:
        """Share of the energy of `partial` that the law explains."""
        energy = float(np.sum(self.partial**2))
        return 1.0 - float(np.sum((self.partial - self.law) ** 2)) / max(energy, 1e-300)


def cloud_of(trace: EffectTrace, row: int, unit: str) -> Cloud:
    """Samples of the row that are known; `unit` of the joint's torque."""
    known = np.isfinite(trace.partial[:, row])
    name, of_x = trace.quantity, trace.unit
    if unit == "N":  # the joint slides
        of_x = of_x.replace("N·m", "N").replace("rad", "m")
    if not name:
        name, of_x = PREDICTED, unit
    return Cloud(
        axis=f"{name} [{of_x}]",
        unit=unit,
        x=trace.x[known, row],
        partial=trace.partial[known, row],
        law=trace.own[known, row],
        period=trace.period,
        diagonal=not trace.quantity,
    )


def together(clouds: Sequence[Cloud]) -> Cloud:
    """Effects of one joint over the same quantity and samples, as one: the laws' sum."""
    first = clouds[0]
    law = np.sum([cloud.law for cloud in clouds], axis=0)
    return replace(first, partial=first.partial - first.law + law, law=law)


def cloud_plot(title: str, cloud: Cloud, caption: str = "") -> Plot:
    """Dots, medians with the middle 80 % of the samples, and the law."""
    words = (
        f"Partial residual torque over {cloud.axis}, with the fitted law, which "
        f"explains {cloud.explained:.1%} of its energy; the law goes from {cloud.law.min():.3g} to "
        f"{cloud.law.max():.3g} {cloud.unit}, samples from {cloud.partial.min():.3g} to "
        f"{cloud.partial.max():.3g} {cloud.unit}."
    )
    factor, unit = readable_unit(cloud.unit, float(np.quantile(np.abs(cloud.partial), 0.98)))
    cloud = replace(cloud, partial=factor * cloud.partial, law=factor * cloud.law)
    if cloud.diagonal:
        cloud = replace(cloud, x=cloud.law, axis=f"{PREDICTED} [{unit}]")
    rng = np.random.default_rng(0)
    dots = rng.permutation(len(cloud.x))[:_MOST_DOTS]
    center, middle, low, high = binned(cloud)
    ends = np.array([cloud.x.min(), cloud.x.max()])
    law = (ends, ends) if cloud.diagonal else law_line(cloud)
    x, (left, median, predicted) = merged(
        (cloud.x[dots], cloud.partial[dots]), (center, middle), law
    )
    whiskers = [_at_points(median, center, end) for end in (low, high)]
    outer = [np.quantile(each, [0.005, 0.995]) for each in (cloud.partial, cloud.law)]
    panel = Panel(
        f"{torque_or_force(unit)} [{unit}]",
        (
            Curve("partial residual", left, "muted", "dots"),
            Curve("median, 80 %", median, "blue", "marks", whiskers[0], whiskers[1]),
            Curve("as predicted" if cloud.diagonal else "fitted law", predicted, "vermilion"),
        ),
        span=limits_about(np.concatenate([*outer, low, high])),
        height=210,
    )  # fmt: skip
    span = limits_about(np.quantile(cloud.x, [0.003, 0.997]), 0.04)
    return Plot(title, words, cloud.axis, x, (panel,), caption=caption, span=span)


def _at_points(points: Array, center: Array, ends: Array) -> Array:
    """Ends of whiskers where `points`, merged with others, has the value of its center."""
    found = np.full(len(points), np.inf)
    found[np.isfinite(points)] = ends[np.argsort(center, kind="stable")]
    return found


def binned(cloud: Cloud) -> tuple[Array, Array, Array, Array]:
    """Medians of x, and medians, 10 and 90 % of what is left, by bins of x.

    Bins hold equally many samples, and none lies on both sides of zero: many laws jump there.
    """
    rows = []
    for own in _bins(cloud, 15, 20):
        low, middle, high = np.quantile(cloud.partial[own], [0.1, 0.5, 0.9])
        rows.append((np.median(cloud.x[own]), middle, low, high))
    center, middle, low, high = np.array(rows, dtype=float).T
    return center, middle, low, high


def _bins(cloud: Cloud, each: int, most: int) -> list[Indices]:
    """Samples in the order of x, in bins of `each` or more, at most so many to a side of zero."""
    if cloud.period is not None:
        sides = [np.arange(len(cloud.x))]
    else:
        sides = [np.flatnonzero(cloud.x < 0), np.flatnonzero(cloud.x >= 0)]
    found = []
    for side in sides:
        if len(side):
            order = side[np.argsort(cloud.x[side], kind="stable")]
            found += np.array_split(order, int(np.clip(len(side) // each, 1, most)))
    return found


def law_line(cloud: Cloud) -> tuple[Array, Array]:
    """Medians of the law from the first to the last x, broken at zero where it jumps."""
    bins = _bins(cloud, 4, 60)
    spread = np.mean([np.ptp(cloud.law[own]) for own in bins])
    if spread > _NO_FUNCTION * max(np.ptp(cloud.law), 1e-300):  # it depends on more than x
        bins = _bins(cloud, 15, 12)
    x = np.array([np.median(cloud.x[own]) for own in bins])
    law = np.array([np.median(cloud.law[own]) for own in bins])
    order = np.argsort(cloud.x, kind="stable")
    first, last = order[0], order[-1]
    x = np.concatenate([cloud.x[[first]], x, cloud.x[[last]]])
    law = np.concatenate([cloud.law[[first]], law, cloud.law[[last]]])
    below = int(np.sum(x < 0))
    if cloud.period is not None or not 3 < below < len(x) - 3:
        return x, law
    slope = np.median([_slope(x, law, below - 3, below - 1), _slope(x, law, below, below + 2)])
    jump = law[below] - law[below - 1] - slope * (x[below] - x[below - 1])
    if abs(jump) < _STEP_AT_ZERO * (law.max() - law.min()):
        return x, law
    return np.insert(x, below, 0.0), np.insert(law, below, np.nan)


def _slope(x: Array, y: Array, i: int, k: int) -> float:
    return float((y[k] - y[i]) / max(x[k] - x[i], 1e-300))


def window_plot(
    title: str, trace: EffectTrace, row: int, unit: str, caption: str = ""
) -> Plot | None:
    """The two seconds in which the effect shows most, in time; None if they hold too little."""
    inside = _window(trace, row)
    if inside is None:
        return None
    own, left = trace.own[inside, row], trace.partial[inside, row]
    t = trace.t[inside]
    words = (
        f"From {t[0]:.2f} to {t[-1]:.2f} s the partial residual torque ranges from "
        f"{np.nanmin(left):.3g} to {np.nanmax(left):.3g} {unit}; the effect predicts from "
        f"{np.nanmin(own):.3g} to {np.nanmax(own):.3g} {unit}."
    )
    factor, scaled = readable_unit(unit, float(np.nanmax(np.abs(left))))
    panel = Panel(
        f"{torque_or_force(unit)} [{scaled}]",
        (
            Curve("partial residual", factor * left, "muted", "joined"),
            Curve("the effect", factor * own, "vermilion"),
        ),
        height=210,
    )
    return Plot(title, words, "time [s]", t, (panel,), caption=caption)


def _window(trace: EffectTrace, row: int) -> slice | None:
    """Consecutive samples of one part, `_WINDOW` long, with most of the effect's energy."""
    energy = np.nancumsum(np.nan_to_num(trace.own[:, row]) ** 2)
    best, found = 0.0, None
    for part in np.unique(trace.part):
        at = np.flatnonzero(trace.part == part)
        last = np.searchsorted(trace.t[at], trace.t[at] + _WINDOW, side="right") - 1
        gained = energy[at[last]] - energy[at]
        # A touch lies wholly within many windows: take the middle one.
        k = int(np.median(np.flatnonzero(gained >= 0.999 * gained.max())))
        if gained[k] > best and last[k] - k >= 8:
            best, found = float(gained[k]), slice(int(at[k]), int(at[last[k]]) + 1)
    return found
