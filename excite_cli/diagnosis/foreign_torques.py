"""Runs whose torques belong to another motion.

Channels of two files that were joined wrongly, or by a wrong offset in time, leave torques that do
not fit their motion whatever the inertias, while those of all other runs do. Judged by the shares
that the rough model leaves (`torque_shares`), run by run; then the motions of the other runs are
tried.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.torque_shares import RoughModel, Samples, samples_of
from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.dataset import Finding

_SAMPLES = 300
_FOREIGN = 0.4  # share that is left of a run's torques, in the median of its joints
_TIMES = 4.0  # that share over that of the other runs
_BELONGS = 0.3  # of it, left by the motion that they belong to


def check_runs(model: RoughModel, runs: Sequence[PreparedRun]) -> tuple[Finding, ...]:
    """A warning for every run whose torques do not fit its motion, as those of the others do."""
    samples = {name: samples_of(each, _SAMPLES) for name, each in _recordings(runs).items()}
    left = {name: _left(model, each) for name, each in samples.items() if len(each.q)}
    found = []
    for name, share in left.items():
        usual = min((x for other, x in left.items() if other != name), default=np.inf)
        if share < _FOREIGN or share < _TIMES * usual:
            continue
        text = (
            f"torques of {name} do not belong to its motion: {share:.0%} of them do not fit the "
            f"URDF with any friction or stiffness, of other runs {usual:.0%}"
        )
        owner = _owner(model, runs, name, share)
        text += f"; they fit the motion of {owner}. " if owner else ". "
        text += "Join its channels anew, or leave this run out; measurement.trust: true takes it"
        found.append(Finding("foreign_torque", "warning", text, name))
    return tuple(found)


def _recordings(runs: Sequence[PreparedRun]) -> Mapping[str, list[PreparedRun]]:
    found: dict[str, list[PreparedRun]] = {}
    for run in runs:
        found.setdefault(run.run.name, []).append(run)
    return found


def _left(model: RoughModel, samples: Samples) -> float:
    """Share of the torques that is left, in the median of the joints that can be judged."""
    shares = model.own_shares_left([samples])[0, :, 0]
    judged = shares[shares > 0.0]
    return float(np.median(judged)) if len(judged) else 0.0


def _owner(model: RoughModel, runs: Sequence[PreparedRun], name: str, share: float) -> str:
    """The run whose motion the torques of run `name` fit; empty if there is none."""
    torques = [run for run in runs if run.run.name == name]
    best, least = "", _BELONGS * share
    for other, motion in _recordings(runs).items():
        if other != name and len(motion) == len(torques) == 1:
            left = _left(model, samples_of([_with_torque(motion[0], torques[0])], _SAMPLES))
            if left < least:
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
