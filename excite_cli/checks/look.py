"""All that is looked at before any physics: could these be this robot's torques and positions?

A mistake of the set-up is not an effect of the robot, and a diagnosis of such data would be wrong
from the start. What no mistake explains is left to the diagnosis.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from excite_cli.checks import foreign_runs, standing_legs
from excite_cli.checks.own import Log, own_checks
from excite_cli.checks.result import Result, Status
from excite_cli.checks.samples import samples_of
from excite_cli.checks.set_up import CHECKS, Step, mistakes
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import Explained, TextbookFit
from excite_cli.config.spec import Spec
from excite_cli.errors import FileError
from excite_cli.identification.motion_errors import check_motion
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset, Finding, Mask, Run
from excite_cli.robot.model import Robot

BELONG = "torques of this motion"
_SAMPLES, _FEW = 300, 200
_ANY = 10.0  # times the deviations of bodies: then they may be nearly any
_NOTHING = 0.4  # share left in the median of the joints with which no set-up is the true one
_FOREIGN = 0.85  # torques of which this is left have nothing to do with the motion


def look(
    robot: Robot, runs: Sequence[Run], prepared: Sequence[PreparedRun], spec: Spec
) -> list[Result]:
    """Doubts and faults of the runs, filtered and as recorded; of what is trusted, a word."""
    clocked = any(run.dq is not None for run in runs)
    samples = replace(samples_of(prepared, _SAMPLES, clocked), turns=~robot.sliding)
    if spec.measurement.trust or not len(samples.q):
        why = "measurement.trust is set" if len(samples.q) else "no joint moves for long enough"
        text = f"mount, zeros, signs, order, units and clock are not judged: {why}"
        return [Result(BELONG, "not_judged", "ok", text)]
    fit, declared = TextbookFit(robot, samples), Setup.as_declared(robot)
    steps = mistakes(fit, spec)
    setup = steps[-1].after.setup if steps else declared
    foreign = foreign_runs.foreign_runs(robot, prepared, setup if steps else None)
    rest = [run for run in prepared if run.run.name not in {each.runs for each in foreign}]
    if foreign and rest and len(rest) < len(prepared):  # what is wrong of the others
        return [*foreign, *look(robot, runs, rest, spec)]
    own = [each for check in own_checks() for each in check.look(Log(robot, runs, prepared, spec))]
    if not any(step.check.kind == "no_gravity" for step in steps):
        standing = standing_legs.standing_legs(robot, samples.thinned(_FEW))
        if standing:
            return [*standing, *own]
    left = TextbookFit(robot, samples, loose=_ANY)(setup)
    unexplained = _unexplained(left, robot.joint_names, spec)
    if any(each.status == "fault" for each in unexplained):  # then steps have led nowhere
        return [*unexplained, *own]
    if steps and steps[-1].left_after.left > _NOTHING:
        return [_no_set_up(robot.joint_names, steps[-1].left_after), *unexplained, *own]
    found = [_result(step, declared, robot.joint_names, spec) for step in steps]
    return [*found, *unexplained, *own]


def findings_of(
    robot: Robot,
    runs: Sequence[Run],
    prepared: Sequence[PreparedRun],
    processing: Processing,
    spec: Spec,
) -> tuple[Finding, ...]:
    """What is to be known of runs that are fitted: motion, and what `look` doubts.

    Raises
    ------
    FileError
        `look` finds a fault.
    """
    found = without_fault(look(robot, runs, prepared, spec))
    motion: tuple[Finding, ...] = ()
    if spec.measurement.filter.position == "auto":
        motion = check_motion(runs, processing, robot.joint_names)
    return (*motion, *(each.finding for each in found if each.status != "ok"))


def without_fault(found: Sequence[Result]) -> Sequence[Result]:
    """The same, if none of them is a fault.

    Raises
    ------
    FileError
        One is.
    """
    faults = [each.evidence.removesuffix(".") for each in found if each.status == "fault"]
    if faults:
        raise FileError(f"the measured data contradict the robot: {'; and '.join(faults)}.")
    return found


def check_dataset(
    robot: Robot, dataset: Dataset, spec: Spec, sealed: str | None = None
) -> tuple[Finding, ...]:
    """As `findings_of`, for all runs but the sealed part, filtered as `spec` says.

    Raises
    ------
    FileError
        As `findings_of`; or a run is too short for the filters.
    """
    needed = spec.identification.needed_runs
    runs = split(dataset, sealed, spec.diagnosis.block, needed).training
    processing = choose_processing(runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    return findings_of(robot, runs, prepare_all(runs, processing), processing, spec)


def _result(step: Step, declared: Setup, names: Sequence[str], spec: Spec) -> Result:
    """A step as one sentence: what is wrong, how sure that is, what to write in the config.

    Keys hold all that was found of one thing so far: a mapping is written whole.
    """
    check, before, after = step.check, step.before, step.after.setup
    shown = step.concerned
    shares = [
        float(np.sqrt(np.mean(np.square(each.shares[shown]))))
        for each in (step.left_before, step.left_after)
    ]
    settings = check.settings(names, spec, declared, after)
    text = check.sentence(names, before, after)
    if settings:
        text += f" (set {written(settings)})"
    text += (
        f". As they are, {shares[0]:.0%} of the torques of {_listed(names, shown)} do not fit the "
        f"URDF with any friction; that way {shares[1]:.0%}."
    )
    others = dict.fromkeys(
        f"{rival.sentence(names, before, other)}"
        + (f" ({written(more)})" if (more := rival.settings(names, spec, declared, other)) else "")
        for rival, other in step.rivals
    )
    if others:
        text += f" As likely: {'. Or: '.join(others)}."
    own = written(check.trusted(names, spec, step.after.joints))
    text += f" If the data are right as they are, say so: {own}"
    status: Status = "fault" if step.is_certain else "doubt"
    joints = tuple(names[j] for j in np.flatnonzero(shown).tolist())
    named = tuple(names[j] for j in step.after.joints) or joints
    return Result(check.name, check.kind, status, text, named, "", settings)


def _no_set_up(names: Sequence[str], left: Explained) -> Result:
    """Another set-up explains more, and none explains enough to be taken for true."""
    off = left.judged & (left.shares > _NOTHING)
    text = (
        f"the torques of {_listed(names, off)} do not fit their motion, and no set-up explains "
        f"most of them: {left.left:.0%} are left with the best. Are positions too coarse, "
        "torques another channel, or is it another robot's"
    )
    return Result(BELONG, "foreign_torque", "doubt", text, tuple(np.array(names)[off].tolist()))


def _unexplained(left: Explained, names: Sequence[str], spec: Spec) -> list[Result]:
    """Torques that do not belong to the motion, for a reason that cannot be named.

    A fault where they are those of most joints. Single joints may have effects as large: a doubt
    where the config says how they are set up, which was taken as it is.
    """
    foreign = left.judged & (left.shares > _FOREIGN)
    status: Status = "fault" if foreign.sum() >= 0.5 * left.judged.sum() else "doubt"
    if status == "doubt":
        foreign &= [any(check.is_declared(name, spec) for check in CHECKS) for name in names]
    if not foreign.any():
        return []
    text = (
        f"the torques of {_listed(names, foreign)} do not fit their motion with any friction, and "
        "no single exchange, sign, zero, unit or mount explains it. Check the order and the signs "
        "of all columns (measurement.names, sign, position_sign), what the torque is "
        "(measurement.torque), and whether this is the robot's URDF. If the data are right as they "
        "are, say so: measurement.trust: true"
    )
    joints = tuple(names[j] for j in np.flatnonzero(foreign).tolist())
    return [Result(BELONG, "foreign_torque", status, text, joints)]


def written(settings: Mapping[str, Any]) -> str:
    """`measurement.sign: {elbow: -1} and …`, as it stands in a config."""
    return " and ".join(f"{key}: {_value(value)}" for key, value in settings.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_value(x)}" for name, x in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _listed(names: Sequence[str], chosen: Mask) -> str:
    return ", ".join(names[j] for j in np.flatnonzero(chosen).tolist())
