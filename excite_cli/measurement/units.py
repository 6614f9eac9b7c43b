"""Impossible units: milliseconds for seconds, degrees for radians, odd gains of the speed.

Judged without a model of the dynamics: recorded speeds against differentiated positions, speeds
and positions against the robot's limits, the sampling rate against any rate of a robot's bus.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.clock import check_clock
from excite_cli.measurement.dataset import Array, Finding, Mask, Run
from excite_cli.measurement.speeds import Speeds, speeds
from excite_cli.measurement.torque import METERS, SECONDS

_DEGREES, _RPM = 180 / np.pi, 30 / np.pi
_CLOSE = 0.2  # share by which a gain may miss the factor it is taken for
_ODD = 0.2  # share by which a gain may miss 1
_RATES = (20.0, 50_000.0)  # Hz, of robots' logs
_SLOW = 0.005  # of the speed limit
_TOO_FAST = 20.0  # times the speed limit
_ABSURD = 20.0  # times the effort limit, of a joint whose neighbours keep theirs
_FAR = 20.0  # times the limits of a slide: in cm or mm, a fifth of its range
_COUNTED = 60.0  # times the limits: more than degrees would be
_BITS = range(10, 25)  # of encoders, a turn
_USUAL_SPEED = 3.0  # rad/s, of a robot without a limit


@dataclass(frozen=True)
class Limits:
    """What the robot allows, (n,) each, infinite where nothing is known; which joints turn."""

    lower: Array
    upper: Array
    velocity: Array
    effort: Array
    revolute: Mask

    @classmethod
    def unknown(cls, n: int) -> "Limits":
        """No limits, all joints turn."""
        infinite = np.full(n, np.inf)
        return cls(-infinite, infinite, infinite, infinite, np.ones(n, bool))


def check_units(
    runs: Sequence[Run], spec: MeasurementSpec, joints: tuple[str, ...], limits: Limits
) -> list[Finding]:
    """Findings about time, angles and torque of equidistant runs of one file."""
    found = speeds(runs)
    where = ", ".join(run.label for run in runs)
    findings = _time_by_speed(found, spec, where) or _time_by_limits(
        runs, found, spec, limits, where
    )
    if not findings:
        findings = _angle_by_speed(found, spec, limits, where) or _angle_by_limits(
            runs, found, spec, limits, where
        )
        findings += _length_by_limits(runs, joints, spec, limits, where)
    if not findings:
        findings = check_clock(runs, where) or _odd_gains(found, joints, spec, where)
        findings += _outside(runs, joints, limits, where)
    return findings + _torque(runs, joints, limits, where)


def _gain(found: Speeds, among: Mask | None = None) -> float:
    """Median gain of the recorded speeds of joints that follow their own positions; NaN if none."""
    if found.recorded is None:
        return float("nan")
    follows = np.abs(np.diag(found.correlation())) > 0.8
    if among is not None:
        follows = follows & among
    return float(np.median(np.abs(found.gain()[follows]))) if follows.any() else float("nan")


def _near(value: float, factor: float) -> bool:
    return bool(abs(value / factor - 1) < _CLOSE)


def _unit_for(seconds: float) -> str:
    return next((unit for unit, s in SECONDS.items() if _near(seconds, s)), "")


def _time_by_speed(found: Speeds, spec: MeasurementSpec, where: str) -> list[Finding]:
    gain = _gain(found)
    unit = _unit_for(SECONDS[spec.time] / gain) if gain > 0 else ""
    if not unit or unit == spec.time:
        return []
    text = (
        f"recorded speeds are {gain:.4g} times the change of position per time: time stamps are "
        f"in {unit}, not {spec.time}. Write measurement.time: {unit}"
    )
    return [Finding("units", "error", text, where, (), {"measurement.time": unit})]


def _time_by_limits(
    runs: Sequence[Run], found: Speeds, spec: MeasurementSpec, limits: Limits, where: str
) -> list[Finding]:
    """Without recorded speeds: rate and speed must both be absurd, and sensible in another unit."""
    if found.recorded is not None:
        return []
    rate = 1 / float(np.median([run.step for run in runs]))
    limit = np.where(np.isfinite(limits.velocity), limits.velocity, _USUAL_SPEED)
    share = float((found.fastest / limit).max())
    low, high = _RATES
    slow = rate < low and share < _SLOW
    fast = rate > high and share > _TOO_FAST
    if not (slow or fast):
        return []
    for unit, seconds in SECONDS.items():
        factor = SECONDS[spec.time] / seconds
        if low <= rate * factor <= high and _SLOW < share * factor < 1.5:
            text = (
                f"samples come at {rate:.4g} Hz and the fastest joint reaches {share:.2g} of its "
                f"speed limit; read in {unit} it is {rate * factor:.4g} Hz and "
                f"{share * factor:.2g}. Write measurement.time: {unit}"
            )
            return [Finding("units", "error", text, where, (), {"measurement.time": unit})]
    return []


def _angle_by_speed(
    found: Speeds, spec: MeasurementSpec, limits: Limits, where: str
) -> list[Finding]:
    gain = _gain(found, limits.revolute)
    leave = "leave the speeds out (measurement.channels: {dq: null})"
    without: dict[str, object] = {"measurement.channels": {**spec.channels, "dq": None}}
    if _near(gain, 1 / _DEGREES):
        text = (
            f"recorded speeds are 1/{1 / gain:.3g} of the change of position per time: positions "
            f"are in degrees, speeds in rad/s. Write measurement.angle: deg and {leave}"
        )
        if spec.angle == "deg":
            text = (
                f"recorded speeds are 1/{1 / gain:.3g} of the change of position per time: "
                f"positions are in degrees, speeds already in rad/s; {leave}"
            )
        settings = {"measurement.angle": "deg", **without}
        return [Finding("units", "error", text, where, (), settings)]
    for factor, unit in ((_DEGREES, "degrees per second"), (_RPM, "turns per minute")):
        if not _near(gain, factor):
            continue
        text = (
            f"recorded speeds are {gain:.3g} times the change of position per time: speeds are in "
            f"{unit}, positions in radians; {leave}"
        )
        return [Finding("units", "error", text, where, (), without)]
    return []


def _angle_by_limits(
    runs: Sequence[Run], found: Speeds, spec: MeasurementSpec, limits: Limits, where: str
) -> list[Finding]:
    lowest, highest = _extremes(runs)
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
    if far.max() > 3 and fits.all() and (speed / _DEGREES).max() < 1.5:
        worst = float(max(-low.min(), high.max()))
        text = (
            f"positions reach {worst:.4g}, {far.max():.3g} times the robot's limits; in degrees "
            "they keep them. Write measurement.angle: deg"
        )
        return [Finding("units", "error", text, where, (), {"measurement.angle": "deg"})]
    travel = (high - low) / (upper - lower)
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


def _length_by_limits(
    runs: Sequence[Run],
    joints: tuple[str, ...],
    spec: MeasurementSpec,
    limits: Limits,
    where: str,
) -> list[Finding]:
    """Of joints that slide: positions far beyond the limits, which keep them in mm or cm."""
    lowest, highest = _extremes(runs)
    slides = ~limits.revolute & np.isfinite(limits.lower) & np.isfinite(limits.upper)
    if not slides.any() or spec.length != "m":
        return []
    lower, upper, low, high = (x[slides] for x in (limits.lower, limits.upper, lowest, highest))
    reach = np.maximum(np.maximum(np.abs(lower), np.abs(upper)), 1e-9)
    far = np.maximum(-low / reach, high / reach)
    slack = 0.1 * (upper - lower)
    if far.max() < _FAR:
        return []
    for unit in ("cm", "mm"):
        scale = METERS[unit]
        if ((scale * low > lower - slack) & (scale * high < upper + slack)).all():
            whose = [joints[j] for j in np.flatnonzero(slides).tolist()]
            text = (
                f"positions of {', '.join(whose)} reach {far.max():.3g} times the robot's limits; "
                f"in {unit} they keep them. Write measurement.length: {unit}"
            )
            settings = {"measurement.length": unit}
            return [Finding("units", "error", text, where, tuple(whose), settings)]
    return []


def _extremes(runs: Sequence[Run]) -> tuple[Array, Array]:
    return (
        np.min([run.q.min(axis=0) for run in runs], axis=0),
        np.max([run.q.max(axis=0) for run in runs], axis=0),
    )


def _odd_gains(
    found: Speeds, joints: tuple[str, ...], spec: MeasurementSpec, where: str
) -> list[Finding]:
    if found.recorded is None:
        return []
    gains, own = found.gain(), np.diag(found.correlation())
    findings = []
    for j in np.flatnonzero((own > 0.8) & (np.abs(gains - 1) > _ODD)).tolist():
        text = (
            f"recorded speed of {joints[j]} is {gains[j]:.3g} times the change of its position: "
            "one of them has another unit or gear ratio (measurement.gear_ratio with position: "
            "motor), or the speed is filtered; nothing needs it (measurement.channels: {dq: null})"
        )
        without = {"measurement.channels": {**spec.channels, "dq": None}}
        findings.append(Finding("gain", "warning", text, where, (joints[j],), without))
    return findings


def _outside(
    runs: Sequence[Run], joints: tuple[str, ...], limits: Limits, where: str
) -> list[Finding]:
    lowest, highest = _extremes(runs)
    span = np.where(np.isfinite(limits.upper - limits.lower), limits.upper - limits.lower, 0.0)
    over = np.maximum(limits.lower - lowest, highest - limits.upper)
    findings = []
    for j in np.flatnonzero(over > 0.02 * span + 1e-6):
        text = (
            f"positions of {joints[j]} reach from {lowest[j]:.4g} to {highest[j]:.4g}, its limits "
            f"are {limits.lower[j]:.4g} and {limits.upper[j]:.4g}: another zero "
            "(measurement.offset), sign (measurement.position_sign) or joint (measurement.names)?"
        )
        findings.append(Finding("outside_limits", "warning", text, where, (joints[j],)))
    return findings


def _torque(
    runs: Sequence[Run], joints: tuple[str, ...], limits: Limits, where: str
) -> list[Finding]:
    """Only a note: effort limits in URDFs are often placeholders."""
    largest = np.max([np.abs(run.tau).max(axis=0) for run in runs], axis=0)
    share = largest / limits.effort
    j = int(np.argmax(share))
    above = np.flatnonzero((share > _ABSURD) & np.isfinite(share)).tolist()
    if above and len(above) < 0.5 * len(joints) and np.delete(share, above).max(initial=0.0) < 3:
        names = [joints[k] for k in above]
        text = (
            f"torques of {', '.join(names)} reach {share[j]:.3g} times their effort limits, those "
            "of the other joints keep them: in mN·m they would keep them, too"
        )
        units = {name: 1e-3 if k in above else 1.0 for k, name in enumerate(joints)}
        settings = {"measurement.torque_unit": units}
        return [Finding("torque_scale", "warning", text, where, tuple(names), settings)]
    if share[j] > 3:
        unit = "N·m" if limits.revolute[j] else "N"
        text = (
            f"torque of {joints[j]} reaches {largest[j]:.4g} {unit}, {share[j]:.3g} times its "
            "effort limit: a placeholder in the URDF, or another unit"
        )
        return [Finding("torque_units", "note", text, where, (joints[j],))]
    if 0 < share.max() < 0.01:
        text = (
            f"torques stay below {share.max():.2g} of the effort limits: are they of the motors, "
            "before the gears (measurement.torque: motor)?"
        )
        return [Finding("torque_units", "warning", text, where)]
    return []
