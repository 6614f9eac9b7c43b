"""Runs whose torques belong to another motion, or to another robot.

Channels of two files that were joined wrongly, or by a wrong offset in time, leave torques that do
not fit their motion whatever the inertias, while those of all other runs do; so do torques of
another robot. Then the motions of the other runs are tried.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.checks.result import Result, Status
from excite_cli.checks.samples import Samples, samples_of
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import TextbookFit
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Robot

NAME = "runs of this robot"
_SAMPLES = 300
_FOREIGN = 0.4  # share that is left of a run's torques, in the median of its joints
_TIMES = 4.0  # that share over that of the other runs
_BELONGS = 0.3  # of it, left by the motion that they belong to


def foreign_runs(
    robot: Robot, runs: Sequence[PreparedRun], setup: Setup | None = None
) -> list[Result]:
    """Every run whose torques do not fit its motion, as those of the others do theirs.

    A fault where they fit that of another run, else a doubt: an effect may be as large, in one run.
    With a robot that is set up as `setup` has it; default: as declared.
    """
    setup = setup or Setup.as_declared(robot)
    recordings = _recordings(runs)
    if len(recordings) < 2:
        return []
    samples = {name: samples_of(each, _SAMPLES) for name, each in recordings.items()}
    left = {name: _left(robot, each, setup) for name, each in samples.items() if len(each.q)}
    found = []
    for name, share in left.items():
        usual = min((x for other, x in left.items() if other != name), default=np.inf)
        if share < _FOREIGN or share < _TIMES * usual:
            continue
        text = (
            f"torques of {name} do not belong to its motion: {share:.0%} of them do not fit the "
            f"URDF with any friction, of other runs {usual:.0%}"
        )
        owner = _owner(robot, recordings, setup, name, share)
        text += (
            f"; they fit the motion of {owner}. " if owner else "; or they are of another robot. "
        )
        text += "Join its channels anew, or leave this run out; measurement.trust: true takes it"
        status: Status = "fault" if owner else "doubt"
        found.append(Result(NAME, "foreign_torque", status, text, runs=name))
    return found


def _recordings(runs: Sequence[PreparedRun]) -> Mapping[str, list[PreparedRun]]:
    found: dict[str, list[PreparedRun]] = {}
    for run in runs:
        found.setdefault(run.run.name, []).append(run)
    return found


def _left(robot: Robot, samples: Samples, setup: Setup) -> float:
    """Share of the torques that is left, in the median of the joints that can be judged."""
    explained = TextbookFit(robot, samples)(setup)
    judged = explained.shares[explained.judged]
    return float(np.median(judged)) if len(judged) else 0.0


def _owner(
    robot: Robot,
    recordings: Mapping[str, list[PreparedRun]],
    setup: Setup,
    name: str,
    share: float,
) -> str:
    """The run whose motion the torques of run `name` fit; empty if there is none."""
    torques = recordings[name]
    best, least = "", _BELONGS * share
    for other, motion in recordings.items():
        if other != name and len(motion) == len(torques) == 1:
            joined = samples_of([_with_torque(motion[0], torques[0])], _SAMPLES)
            if (left := _left(robot, joined, setup)) < least:
                best, least = other, left
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
