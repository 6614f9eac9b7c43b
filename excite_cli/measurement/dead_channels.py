"""Channels that say nothing: constant while the robot moves, or copies of another channel."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Mask, Run, Severity
from excite_cli.measurement.stretches import moves

# rad (m) that a joint goes by its recorded speed where its position does not change: less is the
# noise of a tachometer (6 mrad/s over half a minute make 2 mrad, an offset of 0.2 mrad/s 9 mrad).
_MOVED = 0.05
_MOSTLY, _FEWEST = 0.6, 50  # share of samples in motion with one torque; and how many there must be


def dead_channels(runs: Sequence[Run], joints: tuple[str, ...]) -> tuple[list[Run], list[Finding]]:
    """Name dead and copied channels; joints held still in a single run are masked in it.

    A channel is dead only if it is *exactly* constant: a sensor that works has noise.
    """
    held = np.array([_constant(run.q) for run in runs])  # (runs, n)
    still = np.asarray(held.all(axis=0))
    findings = _whole(runs, joints, still)
    if still.all():
        text = "no joint moves: positions are constant throughout. Is this the right channel?"
        return list(runs), [Finding("dead", "error", text)]
    if all(_constant(run.tau).all() for run in runs) and any(r.usable().any() for r in runs):
        text = (
            f"no torque is in the data: those of all joints are constant (at {runs[0].tau[0, 0]:g} "
            "of the first). Which channel holds them (measurement.channels: {tau: …})?"
        )
        return list(runs), [*findings, Finding("dead_torque", "error", text)]
    kept = []
    for run, stands in zip(runs, held, strict=True):
        checked, more = _of_run(run, joints, stands, still)
        kept.append(checked)
        findings += more + _copies(run, joints)
    return kept, findings


def _constant(values: Array) -> Mask:
    return np.asarray((values == values[0]).all(axis=0))


def _whole(runs: Sequence[Run], joints: tuple[str, ...], still: Mask) -> list[Finding]:
    findings = []
    for j in np.flatnonzero(still):
        value, joint = runs[0].q[0, j], joints[j]
        turns = any(run.dq is not None and not _constant(run.dq)[j] for run in runs)
        if turns and not any(_path(run, int(j)) > _MOVED for run in runs if run.dq is not None):
            text = f"{joint} stands at {value:.6g} in all runs: they say nothing of its friction"
            findings.append(Finding("held", "warning", text, "", (joint,)))
            continue
        why = "its recorded speed is not: the encoder or its column is dead" if turns else (
            "other joints move: if it was really held, leave it out of robot.joints (it is then "
            f"locked at robot.posture: {{{joint}: {value:.4g}}}); else its encoder is dead"
        )  # fmt: skip
        text = f"position of {joint} is constant at {value:.6g} while {why}"
        findings.append(Finding("dead", "error", text, "", (joint,)))
    return findings


def _path(run: Run, joint: int) -> float:
    """How far a joint went by its recorded speed [rad; m]."""
    assert run.dq is not None
    return float(np.ptp(np.cumsum(run.dq[:, joint] * run.step)))


def _of_run(
    run: Run, joints: tuple[str, ...], stands: Mask, still: Mask
) -> tuple[Run, list[Finding]]:
    findings = []
    silent = _constant(run.tau)
    masked = np.zeros(len(joints), bool)
    held = stands | ~moves(run.q, 0, len(run.t))  # an encoder that flickers is no motion
    for j in np.flatnonzero(silent & (run.usable().any(axis=0))):
        joint, level = joints[j], run.tau[0, j]
        if held[j] and not still[j]:
            masked[j] = True
            text = f"{joint} is held in this run and its torque constant at {level:.6g}; masked"
            findings.append(Finding("held", "warning", text, run.name, (joint,)))
        elif not still[j]:
            text = (
                f"torque of {joint} is constant at {level + 0.0:.6g} while it moves: the channel "
                "is dead or too coarse for it (do without: measurement.without_torque), or another "
                "one was meant (measurement.channels, measurement.names)"
            )
            without = {"measurement.without_torque": [joint]}
            findings.append(Finding("dead_torque", "error", text, run.name, (joint,), without))
    for j in np.flatnonzero(stands & ~silent & ~still):
        text = f"position of {joints[j]} is constant at {run.q[0, j]:.6g} in this run"
        findings.append(Finding("held", "note", text, run.name, (joints[j],)))
    findings += _mostly_constant(run, joints, silent | stands)
    if masked.any():
        run = replace(run, valid=run.usable() & ~masked)
    if run.dq is not None:
        dead = tuple(np.array(joints)[_constant(run.dq) & ~stands])
        if dead:
            text = f"recorded speed of {', '.join(dead)} is constant while its position changes; "
            findings.append(
                Finding(
                    "dead_speed", "warning", text + "recorded speeds are not used", run.name, dead
                )
            )
            run = replace(run, dq=None)
    return run, findings


def _mostly_constant(run: Run, joints: tuple[str, ...], known: Mask) -> list[Finding]:
    """Torques that hold one and the same number most of the time while their joint moves."""
    findings = []
    moves = np.zeros(run.q.shape, bool)
    moves[1:] = np.diff(run.q, axis=0) != 0
    for j in np.flatnonzero(~known & (moves.sum(axis=0) >= _FEWEST)):
        levels, counts = np.unique(run.tau[moves[:, j], j], return_counts=True)
        share = counts.max() / counts.sum()
        if share > _MOSTLY:
            text = (
                f"torque of {joints[j]} is exactly {levels[counts.argmax()] + 0.0:.6g} in "
                f"{share:.0%} of the samples in which it moves: the channel carries little "
                "information (too coarse, a dead band, or another joint's). Exclude it "
                "(measurement.without_torque), or map another (measurement.channels, "
                "measurement.names)"
            )
            findings.append(Finding("mostly_constant", "warning", text, run.name, (joints[j],)))
    return findings


def _copies(run: Run, joints: tuple[str, ...]) -> list[Finding]:
    """Two joints with the very same numbers: a column written twice."""
    findings = []
    channels: list[tuple[str, Array, Severity]] = [
        ("torque", run.tau, "error"),
        ("position", run.q, "warning"),
    ]
    for word, values, severity in channels:
        moving = ~_constant(values)
        for j in range(len(joints)):
            same = (values[:, j + 1 :] == values[:, j : j + 1]).all(axis=0) & moving[j]
            for k in np.flatnonzero(same) + j + 1:
                text = (
                    f"{word}s of {joints[j]} and {joints[k]} are the same numbers: one column was "
                    "written twice"
                )
                pair = (joints[j], joints[k])
                findings.append(Finding("duplicate", severity, text, run.name, pair))
    return findings
