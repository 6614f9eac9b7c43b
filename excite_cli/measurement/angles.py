"""Units of positions of joints that turn: degrees or counts for radians, of all joints or some.

Judged by recorded speeds against differentiated positions, and by the robot's limits.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.dataset import Array, Finding, Mask, Run
from excite_cli.measurement.recording_limits import RecordingLimits
from excite_cli.measurement.speeds import Speeds, extremes, following, usual_gain

_DEGREES, _RPM = 180 / np.pi, 30 / np.pi
_CLOSE = 0.2  # share by which a gain may miss the factor it is taken for
_COUNTED = 60.0  # times the limits: more than degrees would be
_BITS = range(10, 25)  # of encoders, a turn
_MOVES, _HARDLY = 0.3, 0.1  # rad; of the travel of joints that are in degrees


def check_angles(
    runs: Sequence[Run],
    found: Speeds,
    joints: tuple[str, ...],
    spec: MeasurementSpec,
    limits: RecordingLimits,
    where: str,
) -> list[Finding]:
    """At most one finding about equidistant runs, whose speeds are `found`."""
    return _angle_by_speed(found, joints, spec, limits, where) or _angle_by_limits(
        runs, found, joints, spec, limits, where
    )


def _angle_by_speed(
    found: Speeds,
    joints: tuple[str, ...],
    spec: MeasurementSpec,
    limits: RecordingLimits,
    where: str,
) -> list[Finding]:
    gain = usual_gain(found, limits.revolute)
    leave = "leave the speeds out (measurement.channels: {dq: null})"
    without: dict[str, object] = {"measurement.channels": {**spec.channels, "dq": None}}
    follows, gains = following(found, limits.revolute)
    slow = follows & (np.abs(gains * _DEGREES - 1) < _CLOSE)
    if slow.any():
        ratio = f"1/{1 / float(np.median(gains[slow])):.3g} of the change of position per time"
        if spec.angle == "deg" and slow[follows].all():
            text = (
                f"recorded speeds are {ratio}: positions are in degrees, speeds already in rad/s; "
                f"{leave}"
            )
            return [Finding("units", "error", text, where, (), without)]
        unit, whose = _in_degrees(slow, follows, joints, spec)
        text = (
            f"recorded speeds{_of(whose)} are {ratio}: positions are in degrees, speeds in rad/s. "
            f"Write measurement.angle: {_written(unit)} and {leave}"
        )
        settings = {"measurement.angle": unit, **without}
        return [Finding("units", "error", text, where, whose, settings)]
    for factor, unit in ((_DEGREES, "degrees per second"), (_RPM, "turns per minute")):
        if not abs(gain / factor - 1) < _CLOSE:
            continue
        text = (
            f"recorded speeds are {gain:.3g} times the change of position per time: speeds are in "
            f"{unit}, positions in radians; {leave}"
        )
        return [Finding("units", "error", text, where, (), without)]
    return []


def _angle_by_limits(
    runs: Sequence[Run],
    found: Speeds,
    joints: tuple[str, ...],
    spec: MeasurementSpec,
    limits: RecordingLimits,
    where: str,
) -> list[Finding]:
    lowest, highest = extremes(runs)
    bounded = limits.revolute & np.isfinite(limits.lower) & np.isfinite(limits.upper)
    if not bounded.any():
        return []
    lower, upper = limits.lower[bounded], limits.upper[bounded]
    low, high = lowest[bounded], highest[bounded]
    reach = np.maximum(np.abs(lower), np.abs(upper))
    far = np.maximum(-low / reach, high / reach)
    slack = 0.1 * (upper - lower)
    speed = (found.fastest / limits.velocity)[bounded]
    fits = (low / _DEGREES > lower - slack) & (high / _DEGREES < upper + slack)
    travel = (high - low) / (upper - lower)
    far_off, moved = far > 3, high - low
    # What keeps its limits as it is, and would hardly have moved in degrees, is in radians. Of
    # what would not have moved at all nobody knows: it is as the others that are not far off.
    keeps = (low > lower - slack) & (high < upper + slack)
    radians = keeps & (moved > _MOVES)
    radians &= moved < _HARDLY * np.median(moved[far_off]) if far_off.any() else False
    radians |= keeps & (moved <= _MOVES) & radians.any()
    if far_off.any() and fits[~radians].all() and (speed[~radians] / _DEGREES).max() < 1.5:
        worst = float(max(-low.min(), high.max()))
        every = np.zeros(len(joints), bool)
        every[bounded] = ~radians
        unit, whose = _in_degrees(every, bounded, joints, spec)
        text = (
            f"positions{_of(whose)} reach {worst:.4g}, {far.max():.3g} times the robot's limits; "
            f"in degrees they keep them. Write measurement.angle: {_written(unit)}"
        )
        return [Finding("units", "error", text, where, whose, {"measurement.angle": unit})]
    if spec.angle == "deg" and travel.max() < 0.02 and (travel * _DEGREES).max() > 0.1:
        text = (
            f"positions use {travel.max():.2g} of the robot's range at most: are they in radians "
            "already? Then write measurement.angle: rad"
        )
        return [Finding("units", "warning", text, where, (), {"measurement.angle": "rad"})]
    if far.max() > _COUNTED and spec.angle == "rad":
        return _counts(low, high, lower - slack, upper + slack, where)
    return []


def _counts(low: Array, high: Array, lower: Array, upper: Array, where: str) -> list[Finding]:
    """Positions in counts of an encoder: the fewest a turn that keep the limits."""
    for bits in _BITS:
        unit = 2 * np.pi / 2**bits
        if ((unit * low > lower) & (unit * high < upper)).all():
            text = (
                f"positions reach {max(-low.min(), high.max()):.4g}: they are counts of an "
                f"encoder. With {2**bits} a turn they keep the robot's limits. Write "
                f"measurement.angle: "
                f"{unit:.6g}, rad in one count"
            )
            settings = {"measurement.angle": unit}
            return [Finding("units", "error", text, where, (), settings)]
    return []


def _in_degrees(
    degrees: Mask, judged: Mask, joints: tuple[str, ...], spec: MeasurementSpec
) -> tuple[object, tuple[str, ...]]:
    """`measurement.angle` with `degrees` of some joints, or of all that can be judged; whose."""
    if degrees[judged].all():
        return "deg", ()
    names = tuple(joints[j] for j in np.flatnonzero(degrees).tolist())
    old = spec.angle if isinstance(spec.angle, dict) else {}
    return {**old, **dict.fromkeys(names, "deg")}, names


def _of(names: Sequence[str]) -> str:
    return f" of {', '.join(names)}" if names else ""


def _written(unit: object) -> str:
    if isinstance(unit, dict):
        return "{" + ", ".join(f"{joint}: {x}" for joint, x in unit.items()) + "}"
    return str(unit)
