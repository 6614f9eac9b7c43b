"""A config for a robot of which only the URDF is known: `excite init`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, cast

from excite_cli.api.arguments import checked
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import ConfigError, RobotError, nearest
from excite_cli.proposal.cell import Cell
from excite_cli.proposal.joints import choose_joints, limbs
from excite_cli.proposal.propose import Proposal, Request, path_from
from excite_cli.proposal.propose import propose as propose_config
from excite_cli.robot.allowed_files import FolderRequest as FolderRequest
from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots, is_named
from excite_cli.robot.mesh_paths import Allow as Allow
from excite_cli.robot.mesh_paths import load_with_folders
from excite_cli.robot.model import build_robot
from excite_cli.robot.overview import DescribedRobot, describe, known_robots
from excite_cli.robot.urdf_joints import survey
from excite_cli.shown.answer import Answer
from excite_cli.shown.note import Level, Note, Tell, log_note, never
from excite_cli.summary.problem_notes import proposal_answer
from excite_cli.summary.robots import robot_answer as robot_answer
from excite_cli.summary.robots import robots_answer

# The robots at hand, and the joints of one: `excite robots`.


def list_robots() -> Answer:
    """The robots of example-robot-data, each with what its URDF lacks.

    Raises
    ------
    RobotError
        The package is not installed.
    """
    return robots_answer(known_robots(), list(example_robots()))


@checked()
def describe_robot(robot: str | Path) -> DescribedRobot:
    """Joints of a robot with their limits and links; `robot` is a name of the list, or a URDF file.

    Raises
    ------
    RobotError
        It is neither, or the URDF is wrong.
    """
    return describe(build_robot(RobotSpec(urdf=_urdf(str(robot))), Path.cwd()))


def _urdf(robot: str) -> str:
    """What robot.urdf would be: a file's path, or the prefix and a name."""
    if is_named(robot) or Path(robot).is_file():
        return robot
    if Path(robot).is_dir():
        raise RobotError(f"{robot} is a folder. Give a URDF file, or a name: `excite robots`.")
    known = example_robots()
    if robot not in known:
        raise RobotError(
            f"there is neither a robot nor a file '{robot}'.{nearest(robot, known)} `excite "
            f"robots` lists all names."
        )
    return f"{EXAMPLE_PREFIX}{robot}"


Base = Literal["fixed", "floating"]


@checked()
def propose(
    urdf: str | Path,
    folder: str | Path = ".",
    *,
    joints: Sequence[str] = (),
    base: Base = "fixed",
    package_dirs: Sequence[str | Path] = (),
    xacro_args: Mapping[str, str] | None = None,
    srdf: str | Path | None = None,
    overrides: Sequence[str] = (),
    floor: str | float | None = None,
    boxes: Sequence[str] = (),
    walls: Sequence[str] = (),
    keep_out: Sequence[str] = (),
    allow: Allow = never,
) -> Proposal:
    """A config for a robot of which nothing but the URDF is known: `excite init`.

    `urdf` is a path (relative to `folder`, where the config will lie), `example-robot-data:<name>`
    or `robot_descriptions:<name>`; `joints` those to move, none for a choice of ours;
    `package_dirs` and `xacro_args` as under `robot` in a config; `srdf` a file with postures and
    pairs not to check, else one beside the URDF is taken; `overrides` (`key.path=value`) stand in
    place of what is chosen; `floor` (a height [m], or "none"), `boxes`, `walls` and `keep_out` are
    those of the command's options, and without `floor` a robot that stands gets one under what does
    not move; `allow` is asked whether the robot's files may read a folder outside
    their own (`package_dirs` answers beforehand). The `text` of what is returned is the YAML file,
    `notes` say what was chosen and why.

    Raises
    ------
    RobotError, ConfigError
        The robot lacks what a plan needs, or may not read what it asks for (`OutsideError`); a
        joint is unknown.
    NoAdmissibleMotionError
        No posture of the robot is clear of its limits.

    Examples
    --------
    >>> from excite_cli import propose
    >>> propose("data/smoke_arm.urdf").joints[:2]
    ('shoulder_yaw', 'shoulder_pitch')
    """
    return propose_config(
        Request(
            str(urdf),
            Path(folder),
            tuple(joints),
            base,
            tuple(map(str, package_dirs)),
            dict(xacro_args or {}),
            None if srdf is None else Path(srdf),
            tuple(overrides),
            allow,
            Cell(floor, tuple(boxes), tuple(walls), tuple(keep_out)),
        )
    )


@checked()
def save_proposal(
    robot: str | Path,
    output: str | Path | None = None,
    *,
    joints: Sequence[str] = (),
    base: str = "fixed",
    package_dirs: Sequence[str | Path] = (),
    xacro_args: Mapping[str, str] | None = None,
    srdf: str | Path | None = None,
    overrides: Sequence[str] = (),
    floor: str | float | None = None,
    boxes: Sequence[str] = (),
    walls: Sequence[str] = (),
    keep_out: Sequence[str] = (),
    allow: Allow = never,
    overwrite: bool = False,
    tell: Tell = log_note,
) -> Answer:
    """Write the config that `propose` gives for a robot to `output` (default: <robot>.yaml here).

    `robot` is `example-robot-data:<name>`, `robot_descriptions:<name>` or a file (URDF, xacro,
    MJCF, SDF). What is returned says what was chosen.

    Raises
    ------
    ConfigError, RobotError, NoAdmissibleMotionError
        As `propose`; `base` is neither fixed nor floating.
    FileError
        `output` exists, or cannot be written.
    """
    if base not in ("fixed", "floating"):
        raise ConfigError(f"--base {base}: allowed are fixed and floating.")
    known = is_named(str(robot))
    name = str(robot).partition(":")[2] if known else Path(robot).stem.removesuffix(".urdf")
    path = Path(f"{name}.yaml") if output is None else Path(output)
    with held({"output": path}, overwrite, () if known else (robot,)):
        folder = path.resolve().parent
        source = str(robot) if known else path_from(folder, Path(robot).resolve())
        dirs = tuple(path_from(folder, Path(each).resolve()) for each in package_dirs)
        # A wrong name is reported at once, and what may be read is asked first.
        _, needed = load_with_folders(source, dirs, folder, xacro_args, allow)
        allowed = {each.folder for each in needed}
        words = "fitting collision geometry (once; up to two minutes), choosing posture and pace"
        tell(Note(Level.STEP, words))
        found = propose(
            source,
            folder,
            joints=joints,
            base=cast(Base, base),
            package_dirs=dirs,
            xacro_args=xacro_args,
            srdf=srdf,
            overrides=overrides,
            floor=floor,
            boxes=boxes,
            walls=walls,
            keep_out=keep_out,
            allow=lambda each: each.folder in allowed,
        )
        write_text_atomically(path, found.text)
        return proposal_answer(found, source, str(path))


def limbs_of(
    robot: str,
    package_dirs: Sequence[str | Path] = (),
    xacro_args: Mapping[str, str] | None = None,
    allow: Allow = never,
) -> dict[str, tuple[str, ...]]:
    """The joints that would be moved, by the limb they belong to."""
    dirs = tuple(map(str, package_dirs))
    description, _ = load_with_folders(robot, dirs, Path.cwd(), xacro_args, allow)
    return limbs(choose_joints(survey(description).joints, robot).chosen)
