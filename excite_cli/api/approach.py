"""Motions made playable: entered from rest at a posture, and left for it again."""

from collections.abc import Mapping, Sequence

from excite_cli.excitation.boundary import posture_of
from excite_cli.excitation.entry import program
from excite_cli.excitation.problem import Problem
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.trajectory.fade import Chain, Segment

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
