"""All checks of measured data, in the order in which they can be made.

Missing values first, then what needs the samples as recorded (wrapped positions, dead, stuck,
saturated channels), then the time stamps, then what needs equidistant samples (units, order, sign).
Nothing is dropped without a finding; findings of severity `error` mean that any diagnosis would be
wrong.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.covariates import without_missing_covariates
from excite_cli.measurement.dataset import Array, Dataset, Finding, Mask, Run, merged
from excite_cli.measurement.dead_channels import dead_channels
from excite_cli.measurement.missing_values import without_missing
from excite_cli.measurement.recording_limits import RecordingLimits
from excite_cli.measurement.resolution import with_torque_steps
from excite_cli.measurement.speed_lag import check_lag
from excite_cli.measurement.speeds import speeds
from excite_cli.measurement.stamps import equidistant
from excite_cli.measurement.stretches import longest
from excite_cli.measurement.stuck import mask_stuck
from excite_cli.measurement.torque import in_step
from excite_cli.measurement.units import check_units

# Torque that stands at a limit: named with its level and masked.
#
# A torque clipped at L has a heap of samples at exactly L. Near an ordinary extremum the samples
# in a band of width w below it grow like w^(1/2) (a parabola) or w^(1/4) (a flat top): the first
# band then holds at most 2.4 times as many as the next three. A clipped torque holds many times
# more.

_HEAP = 5.0  # samples in the first band, per sample in the next three
_FEWEST = 10
_SHORTEST = 5  # samples in a row
_AROUND = 5  # samples before and after that tell whether a joint moves


def mask_saturated(run: Run, joints: tuple[str, ...], revolute: Mask) -> tuple[Run, list[Finding]]:
    """Mark torques at a plateau as not valid; say its level and its share of moving samples.

    `revolute` (n,): which joints turn; what moves others are forces.
    """
    if len(run.t) <= 2 * _AROUND:
        return run, []
    valid, findings = run.usable().copy(), []
    moving = _moving(run)
    for j, joint in enumerate(joints):
        usable = valid[:, j] & moving[:, j]
        values = run.tau[usable, j]
        if len(values) < _FEWEST or np.ptp(values) == 0:
            continue
        for side, word in ((1.0, "upper"), (-1.0, "lower")):
            at = _plateau(side * values)
            if at is None:
                continue
            level = side * float((side * values).max())
            share, unit = np.count_nonzero(at) / len(values), "N·m" if revolute[j] else "N"
            text = (
                f"torque of {joint} stands at its {word} limit {level:.6g} {unit} in {share:.1%} "
                "of moving samples: saturated, or clipped when recorded; these samples are masked"
            )
            findings.append(Finding("saturated", "warning", text, run.name, (joint,)))
            valid[np.flatnonzero(usable)[at], j] = False
    return (replace(run, valid=valid) if findings else run), findings


def _moving(run: Run) -> Mask:
    """Whether a joint moves around an instant, (T, n); at rest a coarse torque stands too."""
    ahead = np.vstack([run.q[_AROUND:], np.repeat(run.q[-1:], _AROUND, axis=0)])
    behind = np.vstack([np.repeat(run.q[:1], _AROUND, axis=0), run.q[:-_AROUND]])
    return np.asarray(ahead != behind)


def _plateau(values: Array) -> Mask | None:
    """Samples at the top, if they are a plateau."""
    top, span = values.max(), np.ptp(values)
    levels = np.abs(np.diff(values))
    moved = levels[levels > 1e-9 * span]
    step = max(float(moved.min()) if len(moved) else 0.0, 1e-6 * span)  # of the quantisation
    if step > span / 8:
        return None  # too few levels to tell a plateau from a step
    at = values > top - 0.5 * step
    count = int(np.count_nonzero(at))
    below = int(np.count_nonzero(values > top - 3.5 * step)) - count
    enough = count >= max(_FEWEST, 0.003 * len(values))
    if not enough or count < _HEAP * below or longest(at) < _SHORTEST:
        return None
    # A torque of two values only (bang-bang) has no plateau, it has nothing else.
    return at if count < 0.9 * len(values) else None


# Columns in another order, or with another sign, as far as speeds and positions show it.

_FOREIGN, _OWN, _OPPOSITE = 0.9, 0.5, -0.8


def check_order(runs: Sequence[Run], joints: tuple[str, ...], used: bool = False) -> list[Finding]:
    """Recorded speeds that follow another joint's positions, go the other way, or lag behind.

    `used`: accelerations are made of the recorded speeds.
    """
    if any(run.dq is None for run in runs):
        return []
    where = ", ".join(run.label for run in runs)
    correlation = speeds(runs).correlation()
    own = np.diag(correlation)
    foreign = np.where(np.eye(len(joints), dtype=bool), 0.0, correlation)
    best = np.argmax(foreign, axis=1)
    swapped = (foreign.max(axis=1) > _FOREIGN) & (own < _OWN)
    findings = []
    if swapped.any():
        pairs = [
            f"the speed of {joints[i]} follows {joints[best[i]]}" for i in swapped.nonzero()[0]
        ]
        text = (
            f"columns of positions and speeds are in different orders: {', '.join(pairs)}. Correct "
            "the names in the file; if torques are in the order of the positions, leave the "
            "speeds out (measurement.channels: {dq: null})"
        )
        named = tuple(joints[i] for i in swapped.nonzero()[0])
        findings.append(Finding("swapped", "error", text, where, named))
    for j in np.flatnonzero((own < _OPPOSITE) & ~swapped):
        joint = joints[j]
        text = (
            f"recorded speed of {joint} has the opposite sign of its change of position. Either "
            f"positions count the wrong way (measurement.position_sign: {{{joint}: -1}}) or "
            f"speeds do (measurement.velocity_sign: {{{joint}: -1}})"
        )
        findings.append(Finding("sign", "error", text, where, (joint,)))
    return findings or check_lag(runs, used, where)


# Positions of joints that turn, recorded as wrapped angles: they jump by 2π, and are undone.
#
# A jump is the wrap's where the step that is left once whole turns are taken off it is one that the
# joint makes elsewhere, too. Whole turns are added to all of a run until it lies within the limits.

_TURN = 2 * np.pi
_WHOLE = 1.001  # turns within which wrapped angles lie
_USUAL = 3.0  # times the largest step elsewhere that may be left of a jump
_STEP = 0.02  # rad: so much a step may be whatever the others are


def unwrapped(
    runs: Sequence[Run], joints: tuple[str, ...], limits: RecordingLimits
) -> tuple[list[Run], list[Finding]]:
    """Runs whose positions are continuous, and where they were not."""
    found, told = [], []
    for run in runs:
        q = run.q.copy()
        where = []
        for j in np.flatnonzero(limits.revolute).tolist():
            own = _continuous(run.q[:, j])
            if own is not None:
                q[:, j] = _within(own, float(limits.lower[j]), float(limits.upper[j]))
                where.append(joints[j])
        if where:
            text = f"positions of {', '.join(where)} jump by whole turns, and were made continuous"
            told.append(Finding("wrapped", "note", text, run.label, tuple(where)))
            run = replace(run, q=q)
        found.append(run)
    return found, told


def _continuous(q: Array) -> Array | None:
    """Positions (T,) without jumps of whole turns; None where there are none."""
    steps = np.diff(q)
    jumps = np.abs(steps) > np.pi
    if not jumps.any() or jumps.all() or np.ptp(q) > _TURN * _WHOLE:
        return None
    usual = max(float(np.abs(steps[~jumps]).max()), _STEP / _USUAL)
    turns = np.where(jumps, np.round(steps / _TURN), 0.0)
    if np.abs(steps - _TURN * turns)[jumps].max() > _USUAL * usual:
        return None
    return np.asarray(q - _TURN * np.concatenate([[0.0], np.cumsum(turns)]))


def _within(q: Array, lower: float, upper: float) -> Array:
    """The same, whole turns away, nearest to the middle of the limits."""
    middle = 0.5 * (lower + upper) if np.isfinite(lower + upper) else 0.0
    return np.asarray(q - _TURN * np.round((0.5 * (q.min() + q.max()) - middle) / _TURN))


def checked(
    runs: Sequence[Run], spec: MeasurementSpec, joints: tuple[str, ...], limits: RecordingLimits
) -> tuple[list[Run], list[Finding]]:
    """Runs of one file, equidistant and masked, with everything that was seen and done."""
    findings: list[Finding] = []
    whole = []
    for run in runs:
        kept, more = without_missing(run, joints)
        findings += more
        kept, more = without_missing_covariates(kept)
        findings += more
        whole.append(kept)
    whole, more = unwrapped(whole, joints, limits)
    findings += more
    whole, more = dead_channels(whole, joints)
    findings += more
    whole, more = with_torque_steps(whole, joints)
    findings += more
    parts: list[Run] = []
    for run in whole:
        run, more = mask_saturated(run, joints, limits.revolute)
        findings += more
        run, more = mask_stuck(run, joints)
        findings += more
        even, more = equidistant(run)
        parts += [in_step(each, spec.torque_lag) for each in even]
        findings += more
    order = check_order(parts, joints, spec.filter.velocity == "measured")
    units = check_units(parts, spec, joints, limits)
    if any(found.kind == "lag" for found in order):  # which is why a gain is odd
        units = [found for found in units if found.kind not in ("gain", "clock")]
    findings += units + order
    return parts, list(dict.fromkeys(findings))


def raise_for_errors(dataset: Dataset) -> None:
    """Raise one FileError that lists every finding of severity `error`; else do nothing."""
    errors = [found for found in dataset.findings if found.severity == "error"]
    if errors:
        lines = "".join(f"\n- {sentence(found)}" for found in merged(errors))
        where = ", ".join(dataset.sources) or "data from Python"
        raise FileError(f"{where}: these data cannot be used:{lines}")


def sentence(finding: Finding) -> str:
    """`run: text.`, as it is reported to a person."""
    return f"{finding.run}: {finding.text}." if finding.run else f"{finding.text}."
