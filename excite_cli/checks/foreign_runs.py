"""Runs whose torques belong to another motion, or to another robot.

Each run is fitted alone. Torques of another motion hardly fit, while those of other runs do; then
the motions of the others are tried. And what was found is played on the run that fits best, and
that one's on it: of one robot at least one of the two gives most of the torque, also with another
payload, and where one shows less than the other. Torques of another robot neither gives. What fits
but for a fifth of its time (somebody pushed, a hand held on) is no other robot's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.checks.check_result import CheckResult, Status
from excite_cli.checks.setup import Setup, samples_of
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Robot

NAME = "runs of one robot"
_SAMPLES = 300
# Share of the torques that the other run misses, in the median of the joints: of pairs of one robot
# 0.02 to 0.12, of 27 of two robots 0.97 and more.
_FOREIGN = 0.8
_UNFIT, _TIMES = 0.4, 4.0  # share left of a run fitted alone, also over that of the best run
_BRIEF = 0.2  # of a run's instants, which are left out where they alone do not fit
_BELONGS = 0.3  # of it, left by the motion that they belong to


def foreign_runs(
    robot: Robot, runs: Sequence[PreparedRun], cure: Setup | None = None
) -> list[CheckResult]:
    """Every run whose torques do not fit its motion, as those of the others do theirs.

    A fault where they fit that of another run, else a doubt. None is foreign where another set-up,
    the `cure`, is one with which all runs fit: of a wrong one some show more than others.
    """
    recordings = _recordings(runs)
    fits = {name: TextbookFit(robot, samples_of(each, _SAMPLES, sliding=robot.sliding))
            for name, each in recordings.items()}  # fmt: skip
    setup = Setup.as_declared(robot)
    foreign = _foreign(fits, setup)
    if not foreign or (cure is not None and not _foreign(fits, cure)):
        return []
    most = {n: f.without_worst(setup, _BRIEF) if n in foreign else f for n, f in fits.items()}
    lasting = _foreign(most, setup)
    foreign = {name: why for name, why in foreign.items() if name in lasting}
    found = []
    for name, why in foreign.items():
        text = f"torques of {name} do not fit its motion: {why}"
        owner = _owner(robot, recordings, name, fits[name](setup))
        text += (
            f"; they fit the motion of {owner}. "
            if owner
            else ": it may be another robot's, or carry far more. "
        )
        text += (
            f"Join its channels anew, or leave this run out; measurement.trust: [{NAME}] takes it"
        )
        status: Status = "fault" if owner else "doubt"
        found.append(CheckResult(NAME, "foreign_torque", status, text, runs=name, is_open=True))
    return found


def _foreign(fits: Mapping[str, TextbookFit], setup: Setup) -> dict[str, str]:
    """Runs that do not fit, or that the best one does not fit, nor they it; and the figures."""
    found = {name: fit(setup) for name, fit in fits.items() if len(fit.samples.q)}
    judged = [name for name, each in found.items() if each.judged.any()]
    if len(judged) < 2:
        return {}
    best = min(judged, key=lambda name: found[name].loss / found[name].judged.sum())
    usual, why = found[best].left, {}
    for name in judged:
        alone, there, back = (
            found[name].left,
            _missed(fits[name], setup, found[best]),
            _missed(fits[best], setup, found[name]),
        )
        if alone >= max(_UNFIT, _TIMES * usual):
            why[name] = (
                f"{alone:.0%} of them do not fit the URDF with any friction, of {best} {usual:.0%}"
            )
        elif name != best and min(there, back) > _FOREIGN:
            why[name] = f"a textbook's model that fits {best} misses {there:.0%} of them"
    return why


def _missed(fit: TextbookFit, setup: Setup, found: TextbookShares) -> float:
    """Share that is missed, in the median of the joints; 0 where no joint moves in both."""
    shares = fit.missed(setup, found)
    return float(np.nanmedian(shares)) if np.isfinite(shares).any() else 0.0


def _recordings(runs: Sequence[PreparedRun]) -> Mapping[str, list[PreparedRun]]:
    found: dict[str, list[PreparedRun]] = {}
    for run in runs:
        found.setdefault(run.run.name, []).append(run)
    return found


def _owner(
    robot: Robot, recordings: Mapping[str, list[PreparedRun]], name: str, own: TextbookShares
) -> str:
    """The run whose motion the torques of run `name` fit; empty if there is none."""
    torques, setup = recordings[name], Setup.as_declared(robot)
    best, least = "", _BELONGS * own.left
    for other, motion in recordings.items():
        if other != name and len(motion) == len(torques) == 1:
            joined = samples_of(
                [_with_torque(motion[0], torques[0])], _SAMPLES, sliding=robot.sliding
            )
            found = TextbookFit(robot, joined)(setup)
            if found.judged.any() and found.left < least:
                best, least = other, found.left
    return best


def _with_torque(motion: PreparedRun, torque: PreparedRun) -> PreparedRun:
    """The one's motion and the other's torques, as long as both go on."""
    count = min(len(motion.tau), len(torque.tau))
    return replace(
        motion,
        averages=motion.averages[:count],
        tau=torque.tau[:count],
        valid=torque.valid[:count],
        moving=motion.moving[:count],
        usable=motion.usable[:count],
    )
