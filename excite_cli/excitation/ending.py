"""How many motions a sequence has at most: a number is given, or the time is spent."""

from excite_cli.config.spec import SequenceSpec
from excite_cli.errors import ConfigError
from excite_cli.excitation.problem import Problem

# Durations that agree to rounding are equal: three motions of 10 s are within 30 s.
_ROUNDING = 1e-9
_MOST = 20  # motions where a precision or a time is asked for, and no number


def most_motions(sequence: SequenceSpec) -> int:
    """Motions, or the most of them where `until` may end them earlier."""
    return sequence.motions or (1 if sequence.until is None else _MOST)


def motions_within(problem: Problem) -> int:
    """Motions that may be made in all, in the time of `sequence.until`.

    Raises
    ------
    ConfigError
        Not one motion is as short as `until.duration`.
    """
    sequence, duration = problem.spec.sequence, problem.trajectory.duration
    if sequence.until is None or sequence.until.duration is None:
        return most_motions(sequence)
    fitting = int(sequence.until.duration / duration * (1.0 + _ROUNDING))
    if fitting == 0:
        raise ConfigError(
            f"sequence.until.duration: one motion takes {duration:.4g} s, and the time of all is "
            f"{sequence.until.duration:g} s. Allow more, or give a shorter trajectory."
        )
    return min(fitting, most_motions(sequence))
