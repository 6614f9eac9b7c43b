"""Settling a proposed problem: a clear posture, and what must yield so that there is one.

The optimiser's own search looks for a posture. Where it finds none, what prevents one at the best
posture yields: torque limits that do not hold the robot up, the distance kept between
capsules, and capsules of neighbours, whose meshes are kept apart instead. Links whose meshes touch
where the robot stands are reported and left out, as the check of the meshes leaves them out.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.arrays import Array
from excite_cli.config.load_spec import parsed_spec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.constraints.self_collision import MeshClearance
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.start import (
    NoClearPostureError,
    Start,
    broken,
    clear_posture,
    pushed_clear,
    unclear,
)
from excite_cli.excitation.task import MotionTask
from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.geometry.mesh_distances import MeshDistances
from excite_cli.geometry.mesh_pairs import joined_links
from excite_cli.geometry.obstacles import FLOOR
from excite_cli.geometry.pair_tables import near_at_posture
from excite_cli.proposal.assumed_limits import JointPlan
from excite_cli.robot.link_frame import MovedBodies

# A posture to start from: one that others wrote down, bent and away from limits, then clear.

# Kept from limits, as a share of the range.
_INSIDE = 0.1
_BENT = ("elbow", "knee")
_BEND = 0.5


@dataclass(frozen=True)
class FirstPosture:
    """Joint values [rad or m] of moved joints, those of others, and where they come from."""

    moved: dict[str, float]
    others: dict[str, float]
    words: str


def first_posture(
    joints: Sequence[JointPlan], reference: tuple[str, str, Mapping[str, float]]
) -> FirstPosture:
    """The reference posture of an SRDF, else zero; elbows and knees bent, a tenth inside limits."""
    file, state, values = reference
    moved = {}
    for joint in joints:
        low = joint.lower + _INSIDE * joint.width
        high = joint.upper - _INSIDE * joint.width
        value = values.get(joint.name, 0.0)
        if joint.name not in values and any(word in joint.name.lower() for word in _BENT):
            value = _BEND if joint.upper >= -joint.lower else -_BEND
        moved[joint.name] = min(max(value, low), high)
    others = {name: value for name, value in values.items() if name not in moved and value}
    bent = any(any(word in name.lower() for word in _BENT) for name in moved)
    words = f"'{state}' of {file}" if values else "zero" + ", elbows and knees bent" * bent
    return FirstPosture(moved, others, f"{words}, at least a tenth of the range from the limits")


Tree = dict[str, Any]
Comments = dict[tuple[str, ...], str]

_MARGIN, _LEAST_MARGIN = 0.002, 0.0005
_UNBOUNDED_EFFORT = 1e6
# Meshes nearer than this [m] indistinguishable from contact by a table.
_TABLED = 0.002
_SELDOM_APART = 0.8
_ROUNDS = 10
_FEW_TRIES, _MANY_TRIES = 6, 40
_DIGITS, _FINE_DIGITS = 4, 8
_LISTED = 4


@dataclass(frozen=True)
class FeasibleProblem:
    """A problem that has a clear posture: its tree, with comments, and what it was built of."""

    tree: Tree
    comments: Comments
    problem: Problem
    start: Start


def settle(tree: Tree, comments: Comments, folder: Path) -> FeasibleProblem:
    """Find a clear posture, giving way where there is none; paths start from `folder`.

    Raises
    ------
    NoAdmissibleMotionError
        No posture is clear, whatever gives way.
    """
    comments = dict(comments)
    tries, digits, moved = _FEW_TRIES, _DIGITS, False
    around: list[tuple[str, str]] = []
    for _ in range(_ROUNDS):
        problem = build_problem(parsed_spec(tree, "the proposed config"), folder)
        task = MotionTask(problem)
        try:
            start = clear_posture(task, problem.spec.seed, tries, given=False)
        except NoClearPostureError as error:
            around = _around(task, error.posture)
            # What stands around does not yield: a better posture is sought before anything does.
            if (around and tries < _MANY_TRIES) or not _yielded(
                tree, comments, task, error.posture
            ):
                if tries == _MANY_TRIES:
                    raise (_crowded(around, tries) if around else error) from error
                tries = _MANY_TRIES
            continue
        moved = moved or not start.as_configured
        posture = np.round(start.posture, digits)
        written = tree["robot"].setdefault("posture", {})
        written.update(zip(problem.robot.joint_names, posture.tolist(), strict=True))
        if _without_lasting_contacts(tree, comments, problem, posture):
            continue  # other links have capsules of their own then, so what is written is tried
        if unclear(task, posture):
            digits = _FINE_DIGITS
            continue
        if moved:
            comments["robot", "posture"] += ", moved until capsules, limits and torques have room"
        robot = replace(problem.robot, posture=posture)
        return FeasibleProblem(tree, comments, replace(problem, robot=robot), start)
    if around:
        raise _crowded(around, tries)
    raise NoAdmissibleMotionError("No clear posture was found, although limits were loosened.")


def _around(task: MotionTask, posture: Array) -> list[tuple[str, str]]:
    """Capsules too near to obstacles at `posture` (n,), with the obstacles, by name."""
    return [
        (constraint.capsules[i].name, constraint.obstacles[j].name)
        for constraint, columns in unclear(task, posture)
        if isinstance(constraint, Surroundings)
        for i, j in (constraint.pairs.checked[column] for column in columns)
    ]


def _crowded(around: list[tuple[str, str]], tries: int) -> NoAdmissibleMotionError:
    """That obstacles leave no posture, and what to do."""
    pairs = "; ".join(f"{link} – {thing}" for link, thing in around[:_LISTED])
    more = f" and {len(around) - _LISTED} more" if len(around) > _LISTED else ""
    things = dict.fromkeys(thing for _, thing in around)
    advice = []
    if FLOOR in things:
        advice.append(
            "a lower --floor HEIGHT, or --floor none for a robot that hangs or is bolted to a wall"
        )
    if others := [thing for thing in things if thing != FLOOR]:
        advice.append(f"another place for {', '.join(others)} (--box, --wall)")
    return NoAdmissibleMotionError(
        f"No posture of the robot is clear of what stands around it: too near in the best of "
        f"{tries} are {pairs}{more}. Give {', or '.join(advice)}."
    )


def _yielded(tree: Tree, comments: Comments, task: MotionTask, posture: Array) -> bool:
    """Loosen what is violated at `posture` (n,); False if nothing is left to loosen.

    In this order: torque limits, the distance between capsules, capsules of links that touch.
    """
    in_the_way = unclear(task, posture)
    names = task.problem.robot.joint_names
    weak = [
        names[bounded.joints[column]]
        for constraint, columns in broken(task, posture)
        if (bounded := constraint.of_joints) and bounded.quantity == Quantity.TORQUE
        for column in columns
    ]
    if weak:
        _unbound(tree, comments, weak)
        return True
    for constraint, columns in in_the_way:
        if len(constraint.capsules_of(columns[0])) == 2:
            label = constraint.labels[columns[0]]
            if (
                _nearer(tree, comments, label, _MARGIN)
                or _by_meshes(tree, comments, task)
                or _nearer(tree, comments, label, _LEAST_MARGIN)
                or _kept_still(tree, comments, task)
            ):
                return True
            break
    return _without_tabled(tree, comments, in_the_way)


def _without_tabled(
    tree: Tree, comments: Comments, in_the_way: list[tuple[Constraint, tuple[int, ...]]]
) -> bool:
    """Leave out links whose meshes, asked by tables, are too near each other in all postures."""
    own = tree["constraints"].get("self_collision")
    found = [
        [constraint.tables[column].first, constraint.tables[column].second]
        for constraint, columns in in_the_way
        if isinstance(constraint, MeshClearance)
        for column in columns
    ]
    if own is None or not found:
        return False
    _leave_out(own, comments, found)
    own["by_meshes"] = [pair for pair in own.get("by_meshes", ()) if pair not in found]
    if not own["by_meshes"]:
        del own["by_meshes"]
    return True


def _unbound(tree: Tree, comments: Comments, names: list[str]) -> None:
    limits = tree["robot"].setdefault("limits", {})
    for name in dict.fromkeys(names):
        limits.setdefault(name, {})["effort"] = _UNBOUNDED_EFFORT
        comments["robot", "limits", name, "effort"] = (
            "the URDF's effort does not hold it up against gravity; not bounded"
        )


def _nearer(tree: Tree, comments: Comments, label: str, margin: float) -> bool:
    own = tree["constraints"]["self_collision"]
    if own["margin"] <= margin:
        return False
    own["margin"] = margin
    comments["constraints", "self_collision", "margin"] = (
        f"[m] between capsules; {label} leaves no room for more"
    )
    return True


def _by_meshes(tree: Tree, comments: Comments, task: MotionTask) -> bool:
    """Meshes instead of capsules for neighbours; nothing for what touches where the robot stands.

    The meshes of the latter are misplaced or coarse, as `excite check` sees them too. They count
    only if they touch at the posture as configured and at the clearest one near it.
    """
    robot, own = task.problem.robot, tree["constraints"]["self_collision"]
    near = pushed_clear(task, robot.posture)
    meshes, moved, joined = MeshDistances(robot), MovedBodies(robot), joined_links(robot)
    before = (len(own.get("by_meshes", ())), len(own.get("ignore", ())))
    for constraint, columns in unclear(task, near):
        for column in columns:
            both = constraint.capsules_of(column)
            if len(both) != 2:
                continue
            first, second = both
            joints = len(moved.between(first.joint, second.joint))
            for one, other in product(first.links, second.links):
                if frozenset((one, other)) in joined:
                    continue
                here = meshes.distance([one], [other], robot.posture)
                if here <= 0.0 and meshes.distance([one], [other], near) <= 0.0:
                    _leave_out(own, comments, [(one, other)])
                elif joints <= 2 and here > _TABLED and robot.n > 1:
                    _keep_by_meshes(own, comments, (one, other))
    return (len(own.get("by_meshes", ())), len(own.get("ignore", ()))) != before


def _kept_still(tree: Tree, comments: Comments, task: MotionTask) -> bool:
    """Keep joints still until at most two are between links that are too near each other.

    Those nearest to the links go on moving; then their meshes can be kept apart by tables.
    """
    robot = task.problem.robot
    moved = MovedBodies(robot)
    near = pushed_clear(task, robot.posture)
    still: set[int] = set()
    for constraint, columns in broken(task, near):
        for column in columns:
            both = constraint.capsules_of(column)
            if len(both) != 2:
                continue
            first, second = both
            one, other = moved.moving(first.joint), moved.moving(second.joint)
            chains = [np.setdiff1d(one, other), np.setdiff1d(other, one)]
            if sum(map(len, chains)) <= 2:
                continue
            kept = 1 if all(map(len, chains)) else 2
            still |= {int(joint) for chain in chains for joint in chain[:-kept]}
    if not still or len(still) > robot.n / 2:
        return False
    names = [name for joint, name in enumerate(robot.joint_names) if joint not in still]
    lost = [name for joint, name in enumerate(robot.joint_names) if joint in still]
    tree["robot"]["joints"] = [name for name in tree["robot"]["joints"] if name in names]
    before = comments.get(("robot", "joints"), "")
    told = f"not moved, what they carry is too near other links to swing: {', '.join(lost)}"
    comments["robot", "joints"] = f"{before}; {told}" if before else told
    return True


def _without_lasting_contacts(
    tree: Tree, comments: Comments, problem: Problem, posture: Array
) -> bool:
    """Leave out pairs of links whose meshes touch in many postures: no motion keeps them apart.

    The same for those that are as good as in contact where the robot stands: no table can keep
    them apart. Whether there are any that were not left out before.
    """
    own = tree["constraints"].get("self_collision")
    before = len(own.get("ignore", ())) if own is not None else 0
    robot = replace(problem.robot, posture=posture)
    for constraint in problem.constraints:
        if own is None or len(constraint.capsules_of(0)) != 2:
            continue
        for pair in constraint.left_out or ():
            for links in pair.reason.apart:
                if links.percent < 100 * _SELDOM_APART:
                    _leave_out(own, comments, [(links.first, links.second)])
        left_out = tuple((one, other) for one, other in own.get("ignore", ()))
        capsules = constraint.drawing.capsules
        near = near_at_posture(robot, capsules, _pairs(constraint), left_out, _TABLED)
        _leave_out(own, comments, near)
    return own is not None and len(own.get("ignore", ())) != before


def _pairs(constraint: Constraint) -> CollisionPairs:
    """The pairs of capsules that a constraint keeps apart, and those that it does not."""
    place = {capsule: index for index, capsule in enumerate(constraint.drawing.capsules)}
    kept = (constraint.capsules_of(column) for column in range(len(constraint.labels)))
    checked = tuple((place[one], place[other]) for one, other in kept)
    return CollisionPairs(checked, constraint.left_out or ())


def _leave_out(own: Tree, comments: Comments, pairs: Iterable[Sequence[str]]) -> None:
    """Add pairs to those that nothing keeps apart, and why."""
    new = [list(pair) for pair in pairs if list(pair) not in own.get("ignore", ())]
    if not new:
        return
    own.setdefault("ignore", []).extend(new)
    place = ("constraints", "self_collision", "ignore")
    if _TOUCHING not in comments.get(place, ""):
        before = f"{comments[place]}; " if place in comments else ""
        comments[place] = f"{before}{_TOUCHING}"


def _keep_by_meshes(own: Tree, comments: Comments, pair: Sequence[str]) -> None:
    """Add a pair to those that tables of their meshes keep apart."""
    if list(pair) not in own.get("by_meshes", ()):
        own.setdefault("by_meshes", []).append(list(pair))
    comments["constraints", "self_collision", "by_meshes"] = (
        "neighbours whose capsules are fatter than they are"
    )


_TOUCHING = (
    "NOT GUARDED: collision meshes that touch, or all but touch, where the robot stands or in many "
    "postures, so the URDF has them misplaced or too coarse; look at these links before a robot "
    "plays a motion"
)
