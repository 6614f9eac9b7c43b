"""From a file to what is exported of it: motions repeated, entered from rest, slowed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from excite_cli.api.motions import is_motion, motions_of
from excite_cli.config.constraints_spec import ConstraintsSpec, JointLimitsSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.errors import ExciteError, FileError
from excite_cli.excitation.boundary import posture_of
from excite_cli.excitation.entry import PaceLimits, program, slowed_chain
from excite_cli.excitation.inspection import not_in_config
from excite_cli.excitation.motion import Doubt
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.result import Result
from excite_cli.export.timed import instants, repeated, require_own_samples
from excite_cli.measurement.torque import given_law
from excite_cli.motion_formats.catalogue import read_own_motion
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.shown.answer import Command, as_word
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.simulation.leading import LeadingSetPoints
from excite_cli.store.fit_file import fit_knowledge
from excite_cli.store.result_file import read_result, read_samples
from excite_cli.summary.pairs import doubts_in_words
from excite_cli.trajectory.fade import Chain, Segment
from excite_cli.trajectory.sampled import through_samples

# Motions made playable: entered from rest at a posture, and left for it again.

# Positions by joint [rad, m]; joints not named are at robot.posture.
Start = Mapping[str, float]


def start_posture(robot: Robot, start: Start) -> Array:
    """The posture (n,) that motions are entered from.

    Raises
    ------
    ConfigError
        A joint is unknown or does not move, or leaves its limits.
    """
    return posture_of(robot, dict(start), "--from")


def entered(
    problem: Problem, motions: Sequence[Segment], posture: Array, periods: int, tell: Tell
) -> list[Chain]:
    """[entry, motion × periods, return] of every motion, all from rest at `posture` and back.

    Raises
    ------
    NoAdmissibleMotionError, ConfigError
        See `excitation.entry.program`.
    """
    found = []
    for motion in motions:
        chain = program(problem, motion, posture, periods)
        found.append(chain)
        seconds = (f"{name} {each:.3g} s" for name, each in durations_of(chain).items())
        tell(Note(Level.INFO, f"{motion.name}: {', '.join(seconds)}"))
    return found


def durations_of(chain: Chain) -> dict[str, float]:
    """Seconds of `motion` (all periods), and of `entry` and `return` where there are any."""
    seconds: dict[str, float] = {}
    for segment in chain.segments:
        name = segment.name if segment.name in ("entry", "return") else "motion"
        seconds[name] = seconds.get(name, 0.0) + segment.trajectory.duration
    return seconds


@dataclass(frozen=True)
class ChainRequest:
    """Which motions of a result (none: all), how often, how slow, and from which posture.

    `unproved`: also those that do not count as proved. `lead`: seconds for which a set point
    stands, where set points are written that lead the motions; None: the motions.
    """

    chosen: Sequence[int] = ()
    periods: int = 1
    slow: float | None = None
    start: Start | None = None
    unproved: bool = False
    lead: float | None = None


@dataclass(frozen=True)
class ExportedChain:
    """What is written: `pace` is the share of its own pace at which the motion goes.

    `doubt`: why it does not count as proved, although its file says so. `not_modelled`: what its
    verdict does not speak of; empty of a file that has no verdict. `written`: what stands in the
    file, the chain or set points that lead it.
    """

    name: str
    joint_names: tuple[str, ...]
    chain: Chain
    pace: float
    doubt: Doubt = Doubt.NONE
    not_modelled: tuple[str, ...] = ()
    leading: LeadingSetPoints | None = None

    @property
    def written(self) -> Chain | LeadingSetPoints:
        """What has the states that are written."""
        return self.leading or self.chain


def chains_of(file: Path, wanted: ChainRequest, tell: Tell) -> list[ExportedChain]:
    """The motions requested, ready to be sampled.

    Raises
    ------
    FileError, ConfigError, NoAdmissibleMotionError
        The file cannot be read, does not hold or know what is requested, a motion is not the one
        that was proved, or no admissible entry was found.
    """
    if is_motion(file):
        joints, segment = _own_motion(file, wanted)
        return [ExportedChain(segment.name, joints, repeated(segment, wanted.periods, joints), 1.0)]
    result = read_result(file)
    motions, joints = motions_of(result, wanted.chosen, str(file)), result.joint_names
    require_own_samples(file, result, motions, read_samples(file))
    doubts = _doubts(file, result, motions, wanted, tell)
    if wanted.start is not None:
        chains, constraints = _entered(file, result, motions, wanted, tell)
    else:
        chains = [repeated(segment, wanted.periods, joints) for segment in motions]
        constraints = _joint_bounds(file, result) if wanted.slow else ()
    paces = [1.0] * len(chains)
    if wanted.slow is not None:
        limits = PaceLimits.of(constraints, len(joints))
        slowed = [slowed_chain(limits, chain, wanted.slow) for chain in chains]
        chains, paces = [chain for chain, _ in slowed], [pace for _, pace in slowed]
    missing = _not_modelled(file, result)
    found = [
        ExportedChain(segment.name, joints, chain, pace, doubt, missing)
        for segment, chain, pace, doubt in zip(motions, chains, paces, doubts, strict=True)
    ]
    return found if wanted.lead is None else _leading(file, result, found, wanted.lead, tell)


def _leading(
    file: Path, result: Result, chains: Sequence[ExportedChain], step: float, tell: Tell
) -> list[ExportedChain]:
    """With set points that lead the motions, for the drives of the result's config."""
    spec, found = parse_spec(result.config, f"the config stored in {file}"), []
    robot = build_robot(spec.robot, Path(result.config_folder))
    law = given_law(spec.measurement, robot.joint_names, f"--lead: the config stored in {file}")
    speeds = spec.measurement.command.set_point_speeds
    for each in chains:
        leading = LeadingSetPoints(each.chain, robot, law, step, speeds)
        times = instants(leading.duration, 1.0 / step)
        if note := leading.clipped(times, each.name):
            tell(note)
        found.append(replace(each, leading=leading))
    return found


def _not_modelled(file: Path, result: Result) -> tuple[str, ...]:
    """What the config of a result knows nothing of; its robot need not be here."""
    spec = parse_spec(result.config, f"the config stored in {file}")
    own = spec.constraints.self_collision
    return not_in_config(spec, () if own is None else own.without_shapes)


def _own_motion(file: Path, wanted: ChainRequest) -> tuple[tuple[str, ...], Segment]:
    """Joint names and the motion of a file in a controller's format."""
    if wanted.lead is not None:
        raise FileError(
            f"--lead: {file} does not say which robot and drives it was made for. A result file "
            "does; give one."
        )
    others = [number for number in wanted.chosen if number != 1]
    if others:
        raise FileError(f"--motion {others[0]}: {file} holds one motion.")
    found = read_own_motion(file)
    segment = Segment(found.name, *through_samples(found.t, found.q, found.v, found.a))
    if wanted.start is not None or wanted.slow is not None:
        option = "--entry" if wanted.start is not None else "--slow"
        raise FileError(
            f"{option}: {file} does not say which robot and limits it was made for. A result file "
            "does; give one."
        )
    return found.joint_names, segment


def _doubts(
    file: Path, result: Result, motions: Sequence[Segment], wanted: ChainRequest, tell: Tell
) -> list[Doubt]:
    """Why motions do not count as proved; such are written only where that was requested.

    Raises
    ------
    FileError
        One is not the motion that was proved, and `unproved` ones were not requested.
    """
    names = [segment.name for segment in motions]
    chosen = [each for each in result.motions if f"motion_{each.index}" in names]
    if _is_another_robot(file, result):
        chosen = [each if each.doubt else each.doubted(Doubt.OTHER_ROBOT) for each in chosen]
    words = "; ".join(doubts_in_words(chosen))
    if words and not wanted.unproved:
        look = Command(("excite", "check", "CONFIG", as_word(file))).line
        raise FileError(
            f"{file}: {words}. Look at it with `{look}`, which judges it as it is now; to write it "
            "all the same, give --allow-unproved. `excite optimize CONFIG --start FILE` makes "
            "proved motions of those in a file."
        )
    if words:
        tell(Note(Level.WARNING, f"{file}: {words}; written all the same (--allow-unproved)."))
    by_name = {f"motion_{each.index}": each.doubt for each in chosen}
    return [by_name[name] for name in names]


def _is_another_robot(file: Path, result: Result) -> bool:
    """Whether the robot has changed since; one that is not found here says nothing.

    Raises
    ------
    FileError
        Names in another order would send every joint the motion of another one.
    """
    spec = parse_spec(result.config, f"the config stored in {file}")
    try:
        robot = build_robot(spec.robot, Path(result.config_folder))
    except ExciteError:
        return False
    same = robot.fingerprint() == result.fingerprint
    if same and robot.joint_names != result.joint_names:
        raise FileError(
            f"{file} names other joints than the robot it was made for, or in another order: it "
            "was edited. Plan its motions again."
        )
    return not same


def _joint_bounds(file: Path, result: Result) -> tuple[Constraint, ...]:
    """Bounds of the joints by the robot and config that the result was made with."""
    spec = parse_spec(result.config, f"the config stored in {file}")
    robot = build_robot(spec.robot, Path(result.config_folder))
    given = spec.constraints.joint_limits or JointLimitsSpec()
    return build_constraints(ConstraintsSpec(joint_limits=given), robot)


def _entered(
    file: Path, result: Result, motions: Sequence[Segment], wanted: ChainRequest, tell: Tell
) -> tuple[list[Chain], tuple[Constraint, ...]]:
    """The motions from rest at a posture and back to it, and the constraints of their problem."""
    spec = parse_spec(result.config, f"the config stored in {file}")
    folder = Path(result.config_folder)
    problem = build_problem(spec, folder, fit_knowledge(spec, folder))
    posture = start_posture(problem.robot, wanted.start or {})
    return entered(problem, motions, posture, wanted.periods, tell), problem.constraints
