"""Motions made playable: entered from the robot's posture, and left for it again."""

from typing import TYPE_CHECKING

from excite_cli.cli.console import Terminal
from excite_cli.errors import ConfigError

if TYPE_CHECKING:
    from excite_cli.excitation.problem import Problem
    from excite_cli.robot.model import Array, Robot
    from excite_cli.trajectory.chain import Chain, Segment


def posture_from(text: str | None, robot: "Robot") -> "Array":
    """The posture (n,) of `joint=value,joint=value`; joints not named are at robot.posture.

    Raises
    ------
    ConfigError
        The text cannot be read, names an unknown joint or leaves the limits.
    """
    from excite_cli.excitation.boundary import posture_of

    given: dict[str, float] = {}
    for part in () if text is None else (piece.strip() for piece in text.split(",")):
        name, equals, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise ConfigError(f"--from: '{part}' is not joint=value [rad or m].")
        if name.strip() in given:
            raise ConfigError(f"--from: {name.strip()} is given twice.")
        given[name.strip()] = number
    return posture_of(robot, given, "--from")


def playable(
    terminal: Terminal,
    problem: "Problem",
    motions: "list[Segment]",
    posture: "Array",
    periods: int = 1,
) -> "list[Chain]":
    """[entry, motion × periods, return] of every motion, all from rest at `posture` and back.

    Raises
    ------
    NoAdmissibleMotionError, ConfigError
        See `excitation.entry.program`.
    """
    from excite_cli.excitation.entry import program

    found = []
    for motion in motions:
        chain = program(problem, motion, posture, periods)
        found.append(chain)
        terminal.say(f"{motion.name}: {_in_words(chain)}")
    return found


def _in_words(chain: "Chain") -> str:
    """How long entry, motion and return take."""
    return ", ".join(f"{name} {seconds:.3g} s" for name, seconds in durations_of(chain).items())


def durations_of(chain: "Chain") -> dict[str, float]:
    """Seconds of `motion` (all periods), and of `entry` and `return` where there are any."""
    seconds: dict[str, float] = {}
    for segment in chain.segments:
        name = segment.name if segment.name in ("entry", "return") else "motion"
        seconds[name] = seconds.get(name, 0.0) + segment.trajectory.duration
    return seconds
