"""Torque over time, run by run, and the residual over what it depends on."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Diagnosis, ExcessResidual
from excite_cli.diagnosis.traces import Traces
from excite_cli.diagnosis.words import covariate_in_words
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.report.chart import Colour, limits_about, thinned
from excite_cli.report.plot import Curve, Panel, Plot, merged
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Block, Charts, Choice

# Units in which small and large torques read well.


def readable_unit(unit: str, largest: float) -> tuple[float, str]:
    """Factor and unit for values up to `largest`: N·m becomes kN·m, mN·m or µN·m."""
    if largest >= 1e3:
        return 1e-3, f"k{unit}"
    if largest < 1e-5:
        return 1e6, f"µ{unit}"
    if largest < 1e-2:
        return 1e3, f"m{unit}"
    return 1.0, unit


def torque_or_force(unit: str) -> str:
    """What is measured in `unit`."""
    return "torque" if unit.endswith("N·m") else "force"


# Points of all lines together, and of one line at most and at least: the page must stay light.
_BUDGET, _MOST, _FEWEST = 240_000, 700, 150
_SIGMAS = 2.0  # of the noise, on either side of no residual


# What such a card shows, as its section says it.
IN_TIME = (
    "Filtered torque, as used in the fit. Above: measured (broad) and predicted by the model "
    "(thin); in the corner the fit, 100 % less the residual's RMS as a share of the measured "
    "torque's about its mean. Below: residuals"
)


def residuals_in_time(
    traces: Sequence[TorqueTrace],
    joint_names: Sequence[str],
    units: Sequence[str],
    noise: Mapping[str, float] | None = None,
) -> tuple[Block, ...]:
    """A card per joint, a choice of runs; parts that took no part in the fit are shaded.

    `noise` of the torque [N·m] (N) by joint, where it is known.
    """
    options = tuple(
        (label, (Charts(charts),))
        for label, charts in plots_in_time(traces, joint_names, units, noise or {}).items()
    )
    if len(options) < 2:
        return options[0][1] if options else ()
    return (Choice("Run", options),)


def noise_by_joint(found: Diagnosis) -> dict[str, float]:
    """Of the filtered torque [N·m] (N), as the sentences about what is unexplained have it.

    Of joints on which nothing is, of repeated periods, else what the model leaves as noise.
    """
    levels = found.processing.get("noise_rms")
    left = map(float, levels) if isinstance(levels, list) else ()
    known = found.noise_floor or dict(zip(found.joint_names, left, strict=False))
    return known | {each.joint: each.noise or 0.0 for each in found.excess_residuals}


def noise_in_words(found: Diagnosis) -> str:
    """What `noise_by_joint` is."""
    known = "what changes between repetitions of a motion"
    if not found.noise_floor:
        known = "its frequencies above those of the motion"
    return (
        f"±{_SIGMAS:g} times the noise of the measured torque (from {known}; on joints without an "
        "unexplained residual, the RMS of the residual)"
    )


def plots_in_time(
    traces: Sequence[TorqueTrace],
    joint_names: Sequence[str],
    units: Sequence[str],
    noise: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, tuple[Plot, ...]]:
    """A plot per joint, by the run and what it was for."""
    runs: dict[str, list[TorqueTrace]] = {}
    for trace in traces:
        runs.setdefault(trace.run, []).append(trace)
    per_line = _BUDGET // (4 * len(joint_names) * max(len(runs), 1))
    points = min(max(per_line, _FEWEST), _MOST)
    found = {}
    for run, parts in runs.items():
        ordered = sorted(parts, key=lambda part: float(part.t[0]))
        found[_label(run, parts)] = tuple(
            _card(ordered, j, name, unit, points, noise.get(name, 0.0))
            for j, (name, unit) in enumerate(zip(joint_names, units, strict=True))
        )
    return found


def _label(run: str, parts: Sequence[TorqueTrace]) -> str:
    if all(part.held_out for part in parts):
        return f"{run} (held out: took no part in the fit)"
    return run


def _card(
    parts: Sequence[TorqueTrace], j: int, name: str, unit: str, points: int, noise: float
) -> Plot:
    left = [part.measured[:, j] - part.predicted[:, j] for part in parts]
    before = [part.measured[:, j] - part.before[:, j] for part in parts if part.before is not None]
    what = torque_or_force(unit).capitalize()
    words = f"{what} of {name}, measured with RMS {_rms([p.measured[:, j] for p in parts])} {unit}"
    words += f"; the model leaves RMS {_rms(left)} {unit}"
    if before:
        words += f", the declared model without the effects found {_rms(before)} {unit}"
    at = thinned(sum(len(part.t) for part in parts), points)
    measured = _joined([part.measured[at, j] for part in parts])
    predicted = _joined([part.predicted[at, j] for part in parts])
    factor, of_torque = readable_unit(unit, _largest(measured))
    rest = [Curve("model", measured - predicted, "vermilion")]
    if before:
        alone = _joined([part.before[at, j] for part in parts if part.before is not None])
        rest.insert(0, Curve("declared", measured - alone, "muted", "dashed"))
    small, of_left = readable_unit(unit, max(_largest(each.y) for each in rest))
    upper = Panel(
        f"{torque_or_force(unit)} [{of_torque}]",
        (
            Curve("measured", factor * measured, "muted", "band"),
            Curve("model", factor * predicted, "blue"),
        ),
        corner=_fit(measured, predicted),
    )
    known = noise if np.isfinite(noise) else 0.0
    lower = Panel(
        f"residual [{of_left}]",
        tuple(replace(each, y=small * each.y) for each in rest),
        noise=_SIGMAS * small * known,
        corner=f"noise: ±{_SIGMAS:g} × {small * known:.2g}" if known else "",
    )
    mixed = {part.held_out for part in parts} == {False, True}
    return Plot(
        name,
        f"{words}.",
        "time [s]",
        _instants([part.t[at] for part in parts]),
        (upper, lower),
        link=f"time of {parts[0].run}",
        shaded=tuple(
            (float(part.t[0]), float(part.t[-1])) for part in parts if mixed and part.held_out
        ),
    )


def _instants(parts: Sequence[Array]) -> Array:
    """Instants of all parts, and one between any two of them, at which nothing is known."""
    between = [0.5 * (one[-1] + two[0]) for one, two in pairwise(parts)]
    return np.concatenate(
        [parts[0], *(np.r_[t, part] for t, part in zip(between, parts[1:], strict=True))]
    )


def _joined(parts: Sequence[Array]) -> Array:
    """Values at `_instants`."""
    return np.concatenate([parts[0], *(np.r_[np.nan, part] for part in parts[1:])])


def _fit(measured: Array, predicted: Array) -> str:
    """`fit 93 %`: 100 % where nothing is left, 0 % where a constant is as good."""
    known = np.isfinite(measured) & np.isfinite(predicted)
    if not known.any() or not (spread := float(np.std(measured[known]))) > 0.0:
        return ""
    left = float(np.sqrt(np.mean((measured[known] - predicted[known]) ** 2)))
    return f"fit {100.0 * (1.0 - left / spread):.3g} %"


def _rms(series: Sequence[Array]) -> str:
    whole = np.concatenate(list(series))
    whole = whole[np.isfinite(whole)]
    return f"{float(np.sqrt(np.mean(whole**2))):.3g}" if len(whole) else "unknown"


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 1.0


_MOST_DOTS = 400
_UNITS = {"position": "rad", "speed": "rad/s", "acceleration": "rad/s²", "load": "N·m", "time": "s"}
# Where a trace has it.
_SERIES = {"position": "q", "speed": "v", "acceleration": "a", "load": "load", "time": "t"}


def dependence_plots(found: Diagnosis, traces: Traces) -> tuple[Plot, ...]:
    """What is left over what it depends on most."""
    return tuple(
        chart
        for each in found.unexplained
        for covariate in each.depends_on
        for chart in _picture(found, traces, each, covariate)
    )


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
    if covariate.history:
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
