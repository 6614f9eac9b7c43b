"""The residual over the quantities on which it depends."""

import numpy as np

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Diagnosis, ExcessResidual
from excite_cli.diagnosis.traces import Traces
from excite_cli.diagnosis.words import covariate_in_words
from excite_cli.report.chart import Colour, limits_about
from excite_cli.report.plot import Curve, Panel, Plot, merged
from excite_cli.report.residual_chart import readable_unit
from excite_cli.robot.model import Array

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
