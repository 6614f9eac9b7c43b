"""Impossible units: milliseconds for seconds, millimetres for metres, odd gains of the speed.

Judged without a model of the dynamics: recorded speeds against differentiated positions, speeds
and positions against the robot's limits, the sampling rate against any rate of a robot's bus.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.angles import check_angles
from excite_cli.measurement.dataset import Finding, Run
from excite_cli.measurement.recording_limits import RecordingLimits
from excite_cli.measurement.speeds import Speeds, check_clock, extremes, speeds, usual_gain
from excite_cli.measurement.torque import METERS, SECONDS
from excite_cli.measurement.torque_sources.command import Command

_CLOSE = 0.2  # share by which a gain may miss the factor it is taken for
_ODD = 0.2  # share by which a gain may miss 1
_RATES = (20.0, 50_000.0)  # Hz, of robots' logs
_SLOW, _NUMBERED = 0.005, 0.05  # of the speed limit; where stamps are whole seconds
_TOO_FAST = 20.0  # times the speed limit
_ABSURD = 20.0  # times the effort limit, of a joint whose neighbours keep theirs
_FAR = 20.0  # times the limits of a slide: in cm or mm, a fifth of its range
_USUAL_SPEED = 3.0  # rad/s, of a robot without a limit


def check_units(
    runs: Sequence[Run], spec: MeasurementSpec, joints: tuple[str, ...], limits: RecordingLimits
) -> list[Finding]:
    """Findings about time, angles and torque of equidistant runs of one file."""
    found = speeds(runs)
    where = ", ".join(run.label for run in runs)
    findings = _time_by_speed(found, spec, where) or _time_by_limits(
        runs, found, spec, limits, where
    )
    if not findings:
        findings = check_angles(runs, found, joints, spec, limits, where)
        findings += _length_by_limits(runs, joints, spec, limits, where)
    if not findings:
        findings = check_clock(runs, where) or _odd_gains(found, joints, spec, where)
        findings += _outside(runs, joints, limits, where)
    if spec.torque == Command.name and spec.command.kp is None:  # torques of any size, so far
        return findings
    return findings + _torque(runs, joints, limits, where)


def _unit_for(seconds: float) -> str:
    """Not minutes: to a twentieth, speeds are as many times too small beside degrees."""
    near = [unit for unit, s in SECONDS.items() if abs(seconds / s - 1) < _CLOSE and unit != "min"]
    return near[0] if near else ""


def _time_by_speed(found: Speeds, spec: MeasurementSpec, where: str) -> list[Finding]:
    gain = usual_gain(found)
    unit = _unit_for(SECONDS[spec.time] / gain) if gain > 0 else ""
    if not unit or unit == spec.time:
        return []
    text = (
        f"recorded speeds are {gain:.4g} times the change of position per time: time stamps are "
        f"in {unit}, not {spec.time}. Write measurement.time: {unit}"
    )
    return [Finding("units", "error", text, where, (), {"measurement.time": unit})]


def _time_by_limits(
    runs: Sequence[Run], found: Speeds, spec: MeasurementSpec, limits: RecordingLimits, where: str
) -> list[Finding]:
    """Without recorded speeds: rate and speed must both be absurd, and sensible in another unit."""
    if found.recorded is not None:
        return []
    rate = 1 / float(np.median([run.step for run in runs]))
    limit = np.where(np.isfinite(limits.velocity), limits.velocity, _USUAL_SPEED)
    share = float((found.fastest / limit).max())
    low, high = _RATES
    numbered = spec.time == "s" and all((run.t == np.round(run.t)).all() for run in runs)
    slow = rate < low and share < (_NUMBERED if numbered else _SLOW)
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
    if numbered and slow:
        text = (
            "time stamps are the numbers of the samples, not seconds: one a second, with which the "
            f"fastest joint reaches {share:.2g} of its speed limit. Say how long a sample lasts "
            "[s]: measurement.clock, as 0.01 at 100 Hz"
        )
        return [Finding("units", "error", text, where)]
    return []


def _length_by_limits(
    runs: Sequence[Run],
    joints: tuple[str, ...],
    spec: MeasurementSpec,
    limits: RecordingLimits,
    where: str,
) -> list[Finding]:
    """Of joints that slide: positions far beyond the limits, which keep them in mm or cm."""
    lowest, highest = extremes(runs)
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
    runs: Sequence[Run], joints: tuple[str, ...], limits: RecordingLimits, where: str
) -> list[Finding]:
    lowest, highest = extremes(runs)
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
    runs: Sequence[Run], joints: tuple[str, ...], limits: RecordingLimits, where: str
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
