"""What error to expect by speed and load: a chart for every joint."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from excite_cli.identification.processing import processing_of
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.report.chart import Colour, in_figures
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array
from excite_cli.scoring.validity import States, Validity, validity_of
from excite_cli.shown.answer import Charts, Section

_BEYOND = 1.5  # of the speeds and loads that the own data reach
_POINTS = 121
_ROOM = 1.05  # above the largest value
_LOADS: tuple[tuple[str, float, Colour], ...] = (
    ("no load", 0.0, "blue"),
    ("largest load of the data", 1.0, "green"),
    ("1.5 times that", _BEYOND, "vermilion"),
)


def validity_section(
    traces: Sequence[TorqueTrace],
    processing: Mapping[str, Any],
    joint_names: Sequence[str],
    units: Sequence[str],
) -> Section:
    """Where a model can be trusted; of joints that move, away from reversals."""
    charts: tuple[Plot, ...] = ()
    if traces:
        validity = validity_of(traces, processing_of(processing))
        share = np.linspace(0.0, _BEYOND, _POINTS)[:, None]
        s = [_error(validity, share, load) for _, load, _ in _LOADS]
        moving = [j for j, speed in enumerate(validity.speed) if isfinite(speed) and speed > 0.0]
        charts = tuple(
            _chart(joint_names[j], units[j], validity, j, [each[:, j] for each in s])
            for j in moving
        )
    lead = (
        "Error of the torque to expect where the joint moves: noise, and effects that the model "
        "lacks, by what it left of its own data. Shaded: faster than these. The uncertainty of the "
        "parameters comes on top, as in `excite score FILE --job PLAN` for a whole motion."
    )
    blocks = (Charts(charts),) if charts else ()
    return Section("validity", "Where the model can be trusted", blocks, lead, on_paper=False)


def _error(validity: Validity, speed: Array, load: float) -> Array:
    """RMS (m, n) at shares of the largest `speed` (m, 1) and `load` of the own data."""
    zero = np.zeros((len(speed), len(validity.speed)))
    v, carried = zero + speed * validity.speed, zero + load * validity.load
    return np.sqrt(validity.left(States(zero, v, zero, carried, carried)))


def _chart(name: str, unit: str, validity: Validity, joint: int, s: Sequence[Array]) -> Plot:
    fastest, heaviest = float(validity.speed[joint]), float(validity.load[joint])
    labels = [
        f"{words}, {in_figures(load * heaviest)} {unit}" if load else words
        for words, load, _ in _LOADS
    ]
    curves = [
        Curve(label, error, colour)
        for label, error, (_, _, colour) in zip(labels, s, _LOADS, strict=True)
    ]
    told = ", ".join(f"{label}: {in_figures(x[0])} to {in_figures(x[-1])} {unit}"
                     for label, x in zip(labels, s, strict=True))  # fmt: skip
    return Plot(
        name,
        f"Error to expect of {name} from 0 to {_BEYOND:g} times the largest speed. {told}.",
        "speed [m/s]" if unit == "N" else "speed [rad/s]",
        np.linspace(0.0, _BEYOND * fastest, _POINTS),
        (Panel(f"error to expect [{unit}]", tuple(curves), (0.0, _ROOM * max(map(np.max, s)))),),
        shaded=((fastest, _BEYOND * fastest),),
    )
