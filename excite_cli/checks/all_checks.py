"""All that is looked at before any physics: could these be this robot's torques and positions?

A mistake of the set-up is not an effect of the robot, and a diagnosis of such data would be wrong
from the start. What no mistake explains is left to the diagnosis.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import nnls

from excite_cli.checks import foreign_runs, sentences
from excite_cli.checks.base import Log
from excite_cli.checks.catalogue import description_checks, log_checks, setup_checks
from excite_cli.checks.check_result import CheckResult, Status
from excite_cli.checks.set_up_search import mistakes
from excite_cli.checks.setup import Samples, Setup, samples_of
from excite_cli.checks.textbook_fit import TextbookFit
from excite_cli.checks.trust import but_trusted, is_trusted
from excite_cli.config.spec import Spec
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import ContradictionError
from excite_cli.identification.motion_errors import check_motion
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.robot.link_frame import leaves, own_link
from excite_cli.robot.model import Array, Robot

_SAMPLES, _FEW = 300, 200
_ANY = 10.0  # times the deviations of bodies: then they may be nearly any
_NOTHING = 0.4  # share left in the median of the joints with which no set-up is the true one


def look(
    robot: Robot, runs: Sequence[Run], prepared: Sequence[PreparedRun], spec: Spec
) -> list[CheckResult]:
    """Doubts and faults of the runs, filtered and as recorded; of what is trusted, a word."""
    return but_trusted(_look(robot, runs, prepared, spec), spec)


def _look(
    robot: Robot, runs: Sequence[Run], prepared: Sequence[PreparedRun], spec: Spec
) -> list[CheckResult]:
    clocked = any(run.dq is not None for run in runs)
    samples = samples_of(prepared, _SAMPLES, clocked, robot.sliding)
    if spec.measurement.trust is True or not len(samples.q):
        why = "measurement.trust is set" if len(samples.q) else "no joint moves for long enough"
        text = f"mount, zeros, signs, order, units and clock are not judged: {why}"
        return [CheckResult(sentences.BELONG, "not_judged", "ok", text)]
    fit, declared, names = TextbookFit(robot, samples), Setup.as_declared(robot), robot.joint_names
    steps = mistakes(fit, spec)
    setup = steps[-1].after.setup if steps else declared
    foreign: list[CheckResult] = []
    if not is_trusted(foreign_runs.NAME, spec):
        foreign = foreign_runs.foreign_runs(robot, prepared, setup if steps else None)
    rest = [run for run in prepared if run.run.name not in {each.runs for each in foreign}]
    if foreign and rest and len(rest) < len(prepared):  # what is wrong of the others
        return [*foreign, *_look(robot, runs, rest, spec)]
    log = Log(robot, runs, prepared, spec)
    own = [each for check in log_checks() for each in check.look(log)]
    weightless = any(step.check.kind == "no_gravity" for step in steps)
    if not (weightless or is_trusted(NAME, spec)):
        standing = standing_legs(robot, samples.thinned(_FEW))
        if standing:
            return [*standing, *own]
    left = TextbookFit(robot, samples, loose=_ANY)(setup)
    said_already = [
        any(check.is_declared(name, spec) for check in setup_checks()) for name in names
    ]
    unexplained = sentences.unexplained(left, names, said_already)
    if any(each.status == "fault" for each in unexplained):  # then steps have led nowhere
        return [*unexplained, *own]
    if steps and steps[-1].left_after.left > _NOTHING:
        return [sentences.no_set_up(names, steps[-1].left_after), *unexplained, *own]
    return [*sentences.of_steps(steps, declared, names, spec), *unexplained, *own]


def findings_of(
    robot: Robot,
    runs: Sequence[Run],
    prepared: Sequence[PreparedRun],
    processing: Processing,
    spec: Spec,
    seen: Sequence[Finding] = (),
) -> tuple[tuple[Finding, ...], bool]:
    """What is to be known of runs that are fitted: motion, and what `look` doubts.

    And whether a doubt is open, of these or of what was `seen` in the files: until it is resolved
    no effect is confirmed.

    Raises
    ------
    FileError
        `look` finds a fault.
    """
    found = without_fault(look(robot, runs, prepared, spec))
    motion: tuple[Finding, ...] = ()
    if spec.measurement.filter.position == "auto":
        motion = check_motion(runs, processing, robot.joint_names)
    doubts = [each.finding for each in found if each.status != "ok"]
    is_open = any(each.is_open for each in (*found, *rows_of_files(seen, spec)))
    return (*motion, *doubts), is_open and spec.measurement.trust is not True


def also_an_effect(finding: Finding) -> str:
    """The kind of effect that says the same as a doubt of the set-up; empty if none does."""
    return {each.kind: each.effect for each in setup_checks()}.get(finding.kind, "")


def without_fault(found: Sequence[CheckResult]) -> Sequence[CheckResult]:
    """The same, if none of them is a fault.

    Raises
    ------
    ContradictionError
        One is.
    """
    faults = [each for each in found if each.status == "fault"]
    if faults:
        words = "; and ".join(each.evidence.removesuffix(".") for each in faults)
        raise ContradictionError(
            f"the measured data contradict the robot: {words}.",
            [(it.kind, it.joints) for it in faults],
        )
    return found


def check_dataset(
    robot: Robot, dataset: Dataset, spec: Spec, held_out: str | None = None
) -> tuple[Finding, ...]:
    """The findings of `findings_of`, for all runs but the held-out part, filtered as `spec` says.

    Raises
    ------
    FileError
        As `findings_of`; or a run is too short for the filters.
    """
    needed = spec.identification.needed_runs
    runs = split(dataset, held_out, spec.diagnosis.block, needed).training
    processing = choose_processing(runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    return findings_of(robot, runs, prepare_all(runs, processing), processing, spec)[0]


# The rows of `excite inspect`: everything that is looked at, in order, and what came of it.

# What is seen while files are read, by the kind of finding.
_OF_FILES: dict[str, tuple[str, ...]] = {
    "time stamps and gaps": (
        "stamps", "gap", "jitter", "order", "truncated", "ragged", "uneven_periods", "interpolated",
        "slow_rate",
    ),
    "missing or frozen values": (
        "nan", "nan_torque", "nan_speed", "nan_position", "stuck", "stale", "held", "dead",
        "dead_torque", "mostly_constant", "saturated", "no_speed", "torque_steps",
    ),
    "names of columns": ("numbered", "words", "other_joints", "swapped", "sign"),
    "wrapped angles": ("wrapped",),
    "units of positions and time": ("units", "gain", "lag"),
    "limits of the joints": ("outside_limits", "torque_units"),
}  # fmt: skip
_OTHER = "what else was noticed"
_TRUSTED = "not judged: measurement.trust names it"
_SPEEDS = "measurement.channels"  # leaves recorded speeds out, which no fit needs
_STATUS: dict[str, Status] = {"error": "fault", "warning": "doubt", "note": "ok"}


def rows_of_description(robot: Robot, spec: Spec) -> list[CheckResult]:
    """Doubts and faults of the description alone."""
    log = Log(robot, (), (), spec)
    return [each for check in description_checks() for each in check.look(log)]


def rows_of_files(findings: Sequence[Finding], spec: Spec) -> list[CheckResult]:
    """Results of what was seen while files were read; doubts of trusted checks are none.

    A doubt that asks for another config is open. A fault has a key of its own.
    """
    row = {kind: name for name, kinds in _OF_FILES.items() for kind in kinds}
    row |= {check.kind: check.name for check in setup_checks()}
    found = [
        CheckResult(
            row.get(each.kind, _OTHER), each.kind, _STATUS[each.severity], each.text, each.joints,
            each.run, each.settings,
            is_open=each.severity == "warning" and bool({*each.settings} - {_SPEEDS}),
        )
        for each in findings
    ]  # fmt: skip
    faults = [each for each in found if each.status == "fault"]
    return [*faults, *but_trusted((each for each in found if each.status != "fault"), spec)]


def row_names() -> tuple[str, ...]:
    """Of all checks, those of packages among them."""
    groups = (description_checks(), setup_checks(), log_checks())
    first, sought, others = ([check.name for check in group] for group in groups)
    stages = (*_OF_FILES, foreign_runs.NAME, NAME)
    return tuple(dict.fromkeys((*first, *stages, *sought, sentences.BELONG, *others)))


def rows_in_order(
    found: Sequence[CheckResult], judged: bool, spec: Spec
) -> tuple[CheckResult, ...]:
    """Results by the order of rows; a row without any is fine, if it was `judged` or trusted."""
    rows: list[CheckResult] = []
    described = {check.name for check in description_checks()}
    seen = {*described, *_OF_FILES}  # trusted or not
    for name in (*row_names(), _OTHER):
        own = [each for each in found if each.name == name]
        if not own and (judged or name in described) and name != _OTHER:
            is_judged = name in seen or not is_trusted(name, spec)
            own = [CheckResult(name, "", "ok", "" if is_judged else _TRUSTED)]
        rows += own
    return tuple(rows)


# A robot that stands on links of its own, given as if it hung from its base.
#
# Ground that carries a robot at some of its ends does to the joints what bodies of negative mass
# there would: −f/g each, together about as heavy as all of it. Upward forces that are constant
# explain most of what the URDF then leaves of the torques, and of a robot that hangs none of
# that.

NAME = "what supports the robot"
_LEFT = 0.4  # of the energy of what the URDF leaves that upward forces may leave
_WEIGHT = 0.5, 1.5  # of the robot, that they carry together
_MOST_FEET = 4


def standing_legs(robot: Robot, samples: Samples) -> list[CheckResult]:
    """A fault where torques are those of a robot that stands on links of its own."""
    ends = leaves(robot)
    if robot.base_joints or len(ends) < 2 or not samples.known.any():
        return []
    body = RigidBody(robot, standard_parameters(robot), samples.q, samples.v, samples.a)
    rest = np.where(samples.known, samples.tau - body.load, 0.0)
    whole = float(np.sum(rest**2))
    carried = _held(robot, samples, ends)
    mass = float(sum(each.mass for each in robot.model.inertias))
    best, held = whole, np.zeros(0)
    feet: tuple[int, ...] = ()
    for count in range(1, min(_MOST_FEET, len(ends)) + 1):
        for some in combinations(range(len(ends)), count):
            found, left = nnls(carried[:, list(some)], rest.ravel())
            if left**2 < 0.9 * best:  # one more end must be worth it
                best, feet, held = float(left**2), some, found
    explains = bool(whole) and best <= _LEFT * whole
    if not (explains and _WEIGHT[0] * mass < held.sum() < _WEIGHT[1] * mass):
        return []
    links = [own_link(robot, ends[k]).name for k in feet]
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    forces = ", ".join(
        f"{f * gravity:.3g} N at {link}" for f, link in zip(held, links, strict=True)
    )
    text = (
        f"these are torques of a robot that stands on {' and '.join(links)}, not of one that hangs "
        f"or is bolted down: upward forces there ({forces}; it weighs {mass * gravity:.3g} N) "
        f"explain {1 - best / whole:.0%} of what the URDF leaves. Declare robot.base: floating, "
        "robot.rows: [base, joints] and the forces measured there (measurement.wrench), or leave "
        f"the joints that carry it out of robot.joints; measurement.trust: [{NAME}] takes them as "
        "they are"
    )
    return [CheckResult(NAME, "standing", "fault", text)]


def _held(robot: Robot, samples: Samples, ends: tuple[int, ...]) -> Array:
    """What 1 kg that is carried from outside at each end takes off the torques, (T n, ends)."""
    still = np.zeros_like(samples.q)
    columns = RigidBody(robot, standard_parameters(robot), samples.q, still, still).regressor
    masses = [PARAMETERS_PER_BODY * (robot.model_joints[j] - 1) for j in ends]
    taken = np.where(samples.known[:, :, None], -columns[:, :, masses], 0.0)
    return taken.reshape(-1, len(ends))
