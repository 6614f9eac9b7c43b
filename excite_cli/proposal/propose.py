"""A problem that works for a robot of which nothing but the URDF is known."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from excite_cli.config.commented_yaml import commented_yaml
from excite_cli.config.load_spec import apply_override, parse_spec, parsed_spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.problem import with_shapes
from excite_cli.proposal.assumed_limits import (
    MOST_ACCELERATION,
    JointPlan,
    Pace,
    choose_pace,
    plan_limits,
)
from excite_cli.proposal.cell import Cell, Floor, floor_below, put_cell
from excite_cli.proposal.feasibility import (
    Comments,
    FeasibleProblem,
    FirstPosture,
    Tree,
    first_posture,
    settle,
)
from excite_cli.proposal.joints import JointChoice, choose_joints
from excite_cli.proposal.shapes import (
    Shapes,
    choose_shapes,
    chosen_srdf,
    disabled_pairs,
    read_srdf,
    reference_posture,
    srdf_near,
)
from excite_cli.robot.assumed_inertias import with_assumed_inertias
from excite_cli.robot.description import RobotDescription
from excite_cli.robot.mesh_paths import Allow, load_with_folders
from excite_cli.robot.model import build_robot
from excite_cli.robot.urdf_joints import UrdfSurvey
from excite_cli.shown.answer import Shown
from excite_cli.shown.note import never

_TORQUE_SHARE = 0.8
_MARGIN = 0.01
_SECONDS = 60.0
# A diagnosis holds the last one out, and what tells runs apart needs two beside it.
_MOTIONS = 3
_FARTHEST = 3  # folders upwards, for which a path is still told as a relative one
_DENSITY = 1000.0
_ASSUMED = (
    "[kg/m³] the URDF has no masses: its shapes' hulls are taken at this density. Motions excite "
    "parameters of any size; limits of torque are guesses until masses are known"
)
_OF_PAIRS = (("by_meshes",), ("ignore",))
_OWN_OPTION = {
    "robot": "--urdf and the other options",
    "robot.urdf": "--urdf or --robot",
    "robot.joints": "--joints",
    "robot.base": "--base",
    "robot.package_dirs": "--package-dirs",
    "robot.xacro_args": "--xacro-arg",
}


@dataclass(frozen=True)
class Request:
    """What is requested.

    urdf: as robot.urdf says it; folder: that of the config, from which paths start; joints: to
    move, empty for a choice of ours; package_dirs, xacro_args: as under robot; srdf: a file, else
    those near the URDF are looked at; overrides: `key.path=value`, of what is proposed; allow:
    whether a folder outside the robot's own may be read; cell: what stands around the robot.
    """

    urdf: str
    folder: Path
    joints: tuple[str, ...] = ()
    base: Literal["fixed", "floating"] = "fixed"
    package_dirs: tuple[str, ...] = ()
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    srdf: Path | None = None
    overrides: tuple[str, ...] = ()
    allow: Allow = never
    cell: Cell = field(default_factory=Cell)


@dataclass(frozen=True, repr=False)
class Proposal(Shown):
    """A config as text, and in words what was chosen and why.

    `joints` are the moved ones, `left_out` the others by reason, `notes` what was assumed.
    """

    text: str
    joints: tuple[str, ...]
    left_out: dict[str, tuple[str, ...]]
    notes: tuple[str, ...]
    settled: FeasibleProblem


def propose(request: Request) -> Proposal:
    """Choose joints, limits, posture and pace for a robot, and see that it has a clear posture.

    Raises
    ------
    RobotError
        The robot lacks what a plan needs; the message names it.
    OutsideError
        The robot asks for files that it may not read.
    ConfigError
        A joint that is requested is unknown or cannot be moved.
    NoAdmissibleMotionError
        No posture of the robot is clear of its limits.
    """
    dirs, arguments = request.package_dirs, request.xacro_args
    description, allowed = load_with_folders(
        request.urdf, dirs, request.folder, arguments, request.allow
    )
    more = (path_from(request.folder, each.folder) for each in allowed)
    dirs = tuple(dict.fromkeys((*dirs, *more)))
    source = description.path.name
    shapes = choose_shapes(description)
    assumed = not shapes.facts.mass > 0
    if assumed:
        description = with_assumed_inertias(description, _DENSITY)
        shapes = choose_shapes(description)
    facts = shapes.facts
    _require_inertias(facts, source)
    choice = choose_joints(facts.joints, source, request.joints)
    joints = plan_limits(choice.chosen)
    notes = [*description.notes, *choice.in_words()]
    notes += [f"allowed to read {each}" for each in allowed]
    names = tuple(joint.name for joint in joints)
    known = [read_srdf(request.srdf)] if request.srdf else srdf_near(description.path)
    posture = first_posture(joints, reference_posture(known, description.path, names))
    pace = choose_pace(joints)
    srdf = known[0] if request.srdf else chosen_srdf(known, description)
    disabled = disabled_pairs(description, srdf, names, shapes.visual)
    tree, comments = _draft(request, dirs, shapes, choice, joints, posture, pace)
    if assumed:
        tree["robot"]["density"] = _DENSITY
        comments["robot", "density"] = _ASSUMED
        notes.append(f"density: {_ASSUMED}")
    if shapes.any and disabled.pairs:
        tree["constraints"]["self_collision"]["ignore"] = list(map(list, disabled.pairs))
        comments["constraints", "self_collision", "ignore"] = disabled.in_words
    if len(joints) == 1:
        _with_a_criterion(tree, comments, request.folder)
    put_cell(request.cell, tree)
    _override(tree, comments, request.overrides)
    notes += _on_a_floor(tree, comments, request, shapes)
    settled = settle(tree, comments, request.folder)
    notes += shapes.in_words(source)
    notes += disabled.notes if shapes.any else ()
    notes.append(f"posture: {settled.comments['robot', 'posture']}")
    notes.append(f"motion: {settled.comments['trajectory',]}")
    still = [joint.name for joint in joints if joint.name not in settled.tree["robot"]["joints"]]
    if still:
        notes.append(
            f"not moved, what they carry is too near other links to swing: {', '.join(still)}"
        )
    notes += [
        f"{path[2]}: {words}"
        for path, words in settled.comments.items()
        if path[:2] == ("robot", "limits") and len(path) == 4 and path[3] != "acceleration"
    ]
    notes += [
        f"{path[2]}: {words}"
        for path, words in settled.comments.items()
        if path[:2] == ("constraints", "self_collision") and path[2:] in _OF_PAIRS
    ]
    text = commented_yaml(settled.tree, settled.comments, _header(request, description))
    parse_spec(text, "the proposed config")
    return Proposal(text, settled.problem.robot.joint_names, choice.left_out, tuple(notes), settled)


def _draft(
    request: Request,
    dirs: tuple[str, ...],
    shapes: Shapes,
    choice: JointChoice,
    joints: tuple[JointPlan, ...],
    posture: FirstPosture,
    pace: Pace,
) -> tuple[Tree, Comments]:
    """The config before its posture is known to be clear."""
    comments: Comments = {}
    robot: Tree = {"urdf": request.urdf}
    if dirs:
        robot["package_dirs"] = list(dirs)
        comments["robot", "package_dirs"] = "folders beyond its own that the robot's files may read"
    if request.xacro_args:
        robot["xacro_args"] = dict(request.xacro_args)
    robot["base"] = request.base
    if request.base == "floating":
        robot["rows"] = ["base", "joints"]
        comments["robot", "rows"] = "the wrench at the base is measured, and all joint torques"
    else:
        comments["robot", "base"] = (
            "bolted down, on a stand or on a hoist; floating adds the wrench at the base"
        )
    robot["joints"] = [joint.name for joint in joints]
    if choice.in_words():
        comments["robot", "joints"] = "; ".join(choice.in_words())
    others = {**_inside(posture.others, shapes.facts), **_held(shapes.facts)}
    robot["posture"] = {**others, **posture.moved}
    comments["robot", "posture"] = posture.words
    limits = _limits(joints, comments)
    if limits:
        robot["limits"] = limits
    constraints: Tree = {"joint_limits": {"acceleration": MOST_ACCELERATION}}
    comments["constraints", "joint_limits", "acceleration"] = (
        "[rad/s²] no URDF gives it; raise it if the robot can do more"
    )
    if any(not math.isnan(joint.effort) for joint in joints):
        constraints["torque"] = {"scale": _TORQUE_SHARE}
        comments["constraints", "torque"] = "share of the effort limits, with the URDF's inertias"
    if shapes.any:
        constraints["self_collision"] = _self_collision(shapes, comments)
    comments["constraints",] = "a table, walls and more: see surroundings in docs/configuration.md"
    tree: Tree = {
        "robot": robot,
        "trajectory": {
            "family": "fourier",
            "harmonics": pace.harmonics,
            "base_frequency": round(pace.base_frequency, 6),
        },
        "sampling": {"constraints": {"samples": pace.constraint_samples}},
        "criterion": {"kind": "predicted_torque"},
        "constraints": constraints,
        "optimizer": {"max_seconds": _SECONDS},
        "sequence": {"motions": _MOTIONS},
        "seed": 1,
    }
    why = (
        "enough for every joint to use its range"
        if pace.slowest is None
        else f"so that {pace.slowest}, the slowest joint, can use its range"
    )
    comments["trajectory",] = f"{pace.duration:g} s, {why}"
    comments["criterion", "kind"] = (
        "predicts torques of the work best (task: a log or plan of it); condition_number: the "
        "paper's"
    )
    comments["optimizer",] = "per start of a motion; restarts: 16 may find better motions"
    comments["sequence",] = (
        "each on top of the earlier ones; a diagnosis fits all but the last and judges by that one"
    )
    return tree, comments


def _with_a_criterion(tree: Tree, comments: Comments, folder: Path) -> None:
    """Another criterion where the condition number is always 1: of one base parameter."""
    robot = build_robot(parsed_spec(tree, "the proposed config").robot, folder)
    if find_base_parameters(robot).rank == 1:
        tree["criterion"] = {"kind": "log_det"}
        comments["criterion", "kind"] = "the condition number of one base parameter is always 1"


def _on_a_floor(
    tree: Tree, comments: Comments, request: Request, shapes: Shapes
) -> tuple[str, ...]:
    """Put a floor below a robot with a fixed base, unless one is given; what to say of it."""
    around = tree["constraints"].get("surroundings", {})
    said = request.cell.floor is not None or around is None or "floor" in around
    if said or request.base != "fixed":
        return ()
    spec = parsed_spec(tree, "the proposed config")
    floor = Floor(None, "no shapes are looked at that could be kept above it")
    if shapes.any and spec.constraints.self_collision is not None:
        floor = floor_below(with_shapes(build_robot(spec.robot, request.folder), spec.constraints))
    if floor.height is None:
        comments["constraints",] = f"no floor: {floor.words}"
        return (f"no floor: {floor.words}",)
    tree["constraints"]["surroundings"] = {"floor": floor.height, **around}
    comments["constraints", "surroundings", "floor"] = f"[m] {floor.words}"
    return (f"floor: {floor.height:g} m, {floor.words}",)


def _override(tree: Tree, comments: Comments, overrides: tuple[str, ...]) -> None:
    """Put what is given in place of what is proposed; whether it works is then tried as all else.

    Raises
    ------
    ConfigError
        A key is unknown, a value is not allowed, or there is an option for it.
    """
    for override in overrides:
        key = override.partition("=")[0].strip()
        if key in _OWN_OPTION:
            raise ConfigError(f"--set {key}: give it with {_OWN_OPTION[key]}.")
        apply_override(tree, override)
        comments[tuple(key.split("."))] = "as given with --set"
    parsed_spec(tree, "the proposed config with --set")


def _self_collision(shapes: Shapes, comments: Comments) -> Tree:
    """What is kept apart, with comments."""
    where = ("constraints", "self_collision")
    own: Tree = {"capsules": "auto"}
    if shapes.visual:
        own["shapes"] = "visual"
    own["margin"] = _MARGIN
    comments[*where, "margin"] = "[m] between capsules"
    if shapes.without:
        own["without_shapes"] = list(shapes.without)
        comments[*where, "without_shapes"] = (
            "NOT GUARDED: their meshes are missing or cannot be read; name the folder of their "
            "package under robot.package_dirs"
        )
    return own


def _limits(joints: tuple[JointPlan, ...], comments: Comments) -> Tree:
    """Limits of the joints that differ from the URDF's, with comments."""
    limits: Tree = {}
    for joint in joints:
        own: Tree = {}
        if "position" in joint.notes:
            own["position"] = [joint.lower, joint.upper]
        if "velocity" in joint.notes:
            own["velocity"] = joint.velocity
        if joint.acceleration < MOST_ACCELERATION:
            own["acceleration"] = joint.acceleration
        if "effort" in joint.notes:
            own["effort"] = joint.effort
        if own:
            limits[joint.name] = own
        for key, words in joint.notes.items():
            comments["robot", "limits", joint.name, key] = words
    return limits


def _inside(others: dict[str, float], facts: UrdfSurvey) -> dict[str, float]:
    """Values of joints that stay where they are, as far as the URDF allows them."""
    own = {joint.name: joint for joint in facts.joints if joint.mimics is None}
    return {
        name: value
        for name, value in others.items()
        if name in own and own[name].lower <= value <= own[name].upper
    }


def _held(facts: UrdfSurvey) -> dict[str, float]:
    """Where equal limits hold joints."""
    return {
        joint.name: joint.lower for joint in facts.joints if joint.held and joint.mimics is None
    }


def _require_inertias(facts: UrdfSurvey, source: str) -> None:
    if facts.mass > 0:
        return
    what = "no <inertial> at all" if facts.inertial_links == 0 else "no mass: every <mass> is 0"
    raise RobotError(
        f"{source} has {what}, and no shapes that masses could be assumed of: use a URDF with the "
        "masses of its links."
    )


def path_from(start: Path, path: Path) -> str:
    """A path as the config in the folder `start` says it: relative where it is near."""
    relative = os.path.relpath(path, start)
    return str(path) if relative.count("..") > _FARTHEST else relative


def _header(request: Request, description: RobotDescription) -> str:
    return (
        f"{description.name}, proposed by `excite init`. Everything may be changed; units are rad, "
        "s, N·m, kg, m.\nPlan:  excite optimize THIS_FILE -o motions.h5"
    )
