"""NaN and infinite values: taken out, filled and masked, and always reported.

What is larger than anything measured (`BEYOND`) counts as infinite: recorders write such numbers
where they have none, and arithmetic with them overflows. What is smaller than anything measured
(`NOTHING`) is zero: its square vanishes. Stamps may be larger, so that a clock in another unit than
declared is recognised by its steps and not lost here.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array, Finding, Mask, Run

BEYOND = 1e12  # s, rad, m, N·m, N
NOTHING = 1e-30  # the same
_LATEST = 1e30  # of a stamp, in whatever unit: beyond any clock's count since the epoch


def known_values(values: Array) -> Mask:
    """Where there is a number that can have been measured."""
    return np.asarray(np.abs(values) < BEYOND)  # false for NaN too


def known_stamps(t: Array) -> Mask:
    """Where there is a number that a clock can have given."""
    return np.asarray(np.abs(t) < _LATEST)


def without_missing(run: Run, joints: tuple[str, ...]) -> tuple[Run, list[Finding]]:
    """The run without NaN.

    Rows without a time stamp or without a position are taken out (all torques depend on all
    positions), which leaves a gap in time. Missing torques are filled between their neighbours and
    marked as not valid, each for its own joint. Recorded speeds are filled, they are not needed.

    Raises
    ------
    FileError
        Nothing is left.
    """
    findings = []
    run = replace(
        run,
        q=_or_zero(run.q),
        tau=_or_zero(run.tau),
        dq=None if run.dq is None else _or_zero(run.dq),
    )
    stamped = known_stamps(run.t)
    if not stamped.all():
        text = f"{np.count_nonzero(~stamped)} rows without a time stamp are left out"
        findings.append(Finding("nan", "warning", text, run.name))
    placed = known_values(run.q)
    rows = stamped & placed.all(axis=1)
    for joint, missing in zip(joints, (~placed & stamped[:, None]).sum(axis=0), strict=True):
        if missing:
            text = (
                f"position of {joint} is NaN or infinite in {_share(missing, len(run.t))}; these "
                "instants are taken out for all joints"
            )
            findings.append(Finding("nan_position", "warning", text, run.name, (joint,)))
    if np.count_nonzero(rows) < 2:
        raise FileError(
            f"Run {run.name}: no instant has a time stamp and the positions of all joints "
            f"({', '.join(joints)}); nothing is left."
        )
    kept = rows_of(run, rows) if not rows.all() else run
    kept, more = _fill_torque(kept, joints)
    findings += more
    if kept.dq is not None and not known_values(kept.dq).all():
        dq, more = _fill_speed(kept, joints)
        kept, findings = replace(kept, dq=dq), findings + more
    return kept, findings


def _or_zero(values: Array) -> Array:
    """`values` with zeros where they are too small for a square."""
    dust = (np.abs(values) < NOTHING) & (values != 0.0)
    return np.where(dust, 0.0, values) if dust.any() else values


def _share(count: int, total: int) -> str:
    return f"{count} of {total} samples"


def rows_of(run: Run, rows: Mask | NDArray[np.int64]) -> Run:
    """The chosen rows (a mask, or places in order) of all channels."""
    return replace(
        run,
        t=run.t[rows],
        q=run.q[rows],
        tau=run.tau[rows],
        dq=None if run.dq is None else run.dq[rows],
        valid=None if run.valid is None else run.valid[rows],
        extra={key: value[rows] for key, value in run.extra.items()},
        covariates={name: value[rows] for name, value in run.covariates.items()},
    )


def _fill_torque(run: Run, joints: tuple[str, ...]) -> tuple[Run, list[Finding]]:
    known = known_values(run.tau)
    if known.all():
        return run, []
    findings = []
    for j, joint in enumerate(joints):
        missing = int(np.count_nonzero(~known[:, j]))
        if missing == len(run.t):
            text = (
                f"torque of {joint} is NaN or infinite throughout: the channel is dead. Leave the "
                "run out, or do without this torque: measurement.without_torque"
            )
            without = {"measurement.without_torque": [joint]}
            findings.append(Finding("dead_torque", "error", text, run.name, (joint,), without))
        elif missing:
            text = f"torque of {joint} is NaN or infinite in {_share(missing, len(run.t))}; masked"
            findings.append(Finding("nan_torque", "warning", text, run.name, (joint,)))
    return replace(run, tau=_filled(run.tau), valid=run.usable() & known), findings


def _fill_speed(run: Run, joints: tuple[str, ...]) -> tuple[Array | None, list[Finding]]:
    assert run.dq is not None
    known = known_values(run.dq)
    names = tuple(np.array(joints)[~known.all(axis=0)])
    if not known.any(axis=0).all():
        text = f"recorded speed of {', '.join(names)} is NaN; recorded speeds are not used"
        return None, [Finding("nan_speed", "warning", text, run.name, names)]
    text = f"recorded speed of {', '.join(names)} is NaN in {np.count_nonzero(~known)} places"
    return _filled(run.dq), [Finding("nan_speed", "note", f"{text}; filled", run.name, names)]


def _filled(values: Array) -> Array:
    """Every column of (T, n) as `filled_between`."""
    return np.column_stack([filled_between(column) for column in values.T])


def filled_between(values: Array) -> Array:
    """Values (T,), linear between what is known; 0 where nothing is."""
    known, places = known_values(values), np.arange(len(values))
    if not known.any():
        return np.zeros(len(values))
    return values if known.all() else np.interp(places, places[known], values[known])
