"""From a file to what is exported of it: motions repeated, entered from rest, slowed."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from excite_cli.cli.console import Terminal
from excite_cli.errors import ConfigError, FileError

if TYPE_CHECKING:
    from excite_cli.constraints.base import Constraint
    from excite_cli.excitation.result import Result
    from excite_cli.trajectory.chain import Chain, Segment


@dataclass(frozen=True)
class Wanted:
    """Which motion (`all`, or its number), how often, how slow, and from which posture."""

    motion: str
    periods: int
    slow: float | None
    entry: bool
    posture: str | None

    def __post_init__(self) -> None:
        """Raise ConfigError for what cannot be."""
        if self.motion != "all" and not (self.motion.isdecimal() and int(self.motion) > 0):
            raise ConfigError(
                f"--motion {self.motion}: give the number of a motion, from 1, or all."
            )
        if self.posture is not None and not self.entry:
            raise ConfigError("--from says where --entry starts: give both.")


@dataclass(frozen=True)
class ExportedChain:
    """What is written: `pace` is the share of its own pace at which the motion goes."""

    name: str
    joint_names: tuple[str, ...]
    chain: "Chain"
    pace: float


def chains_of(terminal: Terminal, file: Path, wanted: Wanted) -> list[ExportedChain]:
    """The motions asked for, ready to be sampled.

    Raises
    ------
    FileError, ConfigError, NoAdmissibleMotionError
        The file cannot be read, does not hold or know what is asked for, or no admissible entry
        was found.
    """
    from excite_cli.excitation.time_scaling import PaceLimits, slowed_chain
    from excite_cli.export.timed import repeated

    result, joints, motions = _motions(file, wanted.motion)
    if result is None and (wanted.entry or wanted.slow is not None):
        option = "--entry" if wanted.entry else "--slow"
        raise FileError(
            f"{option}: {file} does not say which robot and limits it was made for. A result file "
            "does; give one."
        )
    if result is not None and wanted.entry:
        chains, constraints = _entered(terminal, file, result, motions, wanted)
    else:
        chains = [repeated(segment, wanted.periods, joints) for segment in motions]
        constraints = _joint_bounds(file, result) if result is not None and wanted.slow else ()
    paces = [1.0] * len(chains)
    if wanted.slow is not None:
        limits = PaceLimits.of(constraints, len(joints))
        slowed = [slowed_chain(limits, chain, wanted.slow) for chain in chains]
        chains, paces = [chain for chain, _ in slowed], [pace for _, pace in slowed]
    return [
        ExportedChain(segment.name, joints, chain, pace)
        for segment, chain, pace in zip(motions, chains, paces, strict=True)
    ]


def _motions(file: Path, motion: str) -> "tuple[Result | None, tuple[str, ...], list[Segment]]":
    """The result that `file` is, if it is one; joint names, and the motions asked for."""
    from excite_cli.api.motions import is_motion, motions_of
    from excite_cli.measurement.motion_files import read_own_motion
    from excite_cli.store.result_file import read_result
    from excite_cli.trajectory.chain import Segment
    from excite_cli.trajectory.sampled import through_samples

    if is_motion(file):
        if motion not in ("all", "1"):
            raise FileError(f"--motion {motion}: {file} holds one motion.")
        found = read_own_motion(file)
        segment = Segment(found.name, *through_samples(found.t, found.q, found.v, found.a))
        return None, found.joint_names, [segment]
    result = read_result(file)
    chosen = [] if motion == "all" else [int(motion)]
    return result, result.joint_names, motions_of(result, chosen, str(file))


def _joint_bounds(file: Path, result: "Result") -> "tuple[Constraint, ...]":
    """Bounds of the joints by the robot and config that the result was made with."""
    from excite_cli.config.constraints_spec import ConstraintsSpec, JointLimitsSpec
    from excite_cli.config.load import parse_spec
    from excite_cli.constraints.catalogue import build_constraints
    from excite_cli.robot.model import build_robot

    spec = parse_spec(result.config, f"the config stored in {file}")
    robot = build_robot(spec.robot, Path(result.config_folder))
    given = spec.constraints.joint_limits or JointLimitsSpec()
    return build_constraints(ConstraintsSpec(joint_limits=given), robot)


def _entered(
    terminal: Terminal, file: Path, result: "Result", motions: "list[Segment]", wanted: Wanted
) -> "tuple[list[Chain], tuple[Constraint, ...]]":
    """The motions from rest at a posture and back to it, and the constraints of their problem."""
    from excite_cli.cli.entry_program import playable, posture_from
    from excite_cli.config.load import parse_spec
    from excite_cli.excitation.problem import build_problem

    spec = parse_spec(result.config, f"the config stored in {file}")
    problem = build_problem(spec, Path(result.config_folder))
    posture = posture_from(wanted.posture, problem.robot)
    chains = playable(terminal, problem, motions, posture, wanted.periods)
    return chains, problem.constraints
