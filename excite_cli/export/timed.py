"""From a chain of trajectories to instants with q, v, a, as controllers take them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.result import Result
from excite_cli.motion_formats.timed_motion import TimedMotion
from excite_cli.robot.model import Array
from excite_cli.simulation.leading import Moves
from excite_cli.trajectory.fade import Chain, Segment

MAX_INSTANTS, MAX_PERIODS = 2_000_000, 10_000
# How far q, v, a may be apart at both ends of a motion that is repeated [rad, rad/s, rad/s²].
_CLOSED = 1e-6


def timed_motion(
    name: str,
    joint_names: tuple[str, ...],
    chain: Moves,
    rate: float,
    equidistant: bool = False,
    whole_nanoseconds: bool = False,
) -> TimedMotion:
    """The chain (or set points that lead it) at `instants`, q, v, a exact there.

    Raises
    ------
    ConfigError
        There would be more than two million instants, or less than two.
    """
    t = instants(chain.duration, rate, equidistant)
    if whole_nanoseconds:
        t = np.rint(t * 1e9) / 1e9
    return TimedMotion(name, joint_names, t, *chain.states(t))


def instants(duration: float, rate: float, equidistant: bool = False) -> Array:
    """Instants k/rate from 0 on [s], and the end.

    Where the duration is no whole number of steps, the last step is between half and one and a half
    of the others; with `equidistant` all are a little shorter or longer instead.
    """
    steps = max(1, round(duration * rate))
    if not 1 <= steps < MAX_INSTANTS:
        raise ConfigError(
            f"--rate {rate:g}: {duration:g} s are {steps:,} instants; up to {MAX_INSTANTS:,} are "
            "written. Take a lower rate or fewer periods."
        )
    if equidistant:
        return np.linspace(0.0, duration, steps + 1)
    return np.append(np.arange(steps) / rate, duration)


def repeated(segment: Segment, periods: int, joint_names: tuple[str, ...]) -> Chain:
    """The motion played `periods` times without a break.

    Raises
    ------
    ConfigError
        It does not end as it starts, or there are more than ten thousand periods.
    """
    if not 1 <= periods <= MAX_PERIODS:
        raise ConfigError(f"--periods {periods}: give 1 to {MAX_PERIODS:,}.")
    if periods > 1:
        ends = np.array([0.0, segment.trajectory.duration])
        gaps = [np.abs(x[1] - x[0]) for x in segment.trajectory.states(ends, segment.coefficients)]
        for gap, words in zip(gaps, ("position", "speed", "acceleration"), strict=True):
            if gap.max() > _CLOSED:
                raise ConfigError(
                    f"--periods {periods}: {segment.name} does not end as it starts ({words} of "
                    f"{joint_names[int(gap.argmax())]} differs by {gap.max():.3g}), so it cannot "
                    "go on. Only motions of a Fourier series, and others that close, are repeated."
                )
    return Chain((segment,) * periods)


# Whether the parts of a result agree: nothing is handed to a robot that its file does not state.
#
# A result holds its motions twice, as coefficients (with the trajectory of its config) and as
# samples. Where one of them was edited, or the joints of the config, nobody knows which is meant.

_SAME = 1e-6  # of the largest value: they differ by rounding only


def require_own_samples(
    file: Path,
    result: Result,
    segments: Sequence[Segment],
    samples: Mapping[int, tuple[Array, Array, Array, Array]],
) -> None:
    """See that the motions of a result are those of its samples and joints.

    `samples`: t (T,), q, v, a (T, n) by the index of a motion.

    Raises
    ------
    FileError
        They are not: someone changed one of them.
    """
    joints = parse_spec(result.config, f"the config stored in {file}").robot.joints
    if joints != "all" and set(joints) != set(result.joint_names):
        raise FileError(
            f"{file} moves {', '.join(result.joint_names)}, but its config names "
            f"{', '.join(joints)}. Someone changed one of them: plan the motions anew."
        )
    by_name = {f"motion_{index}": stored for index, stored in samples.items()}
    for segment in segments:
        t, *stored = by_name[segment.name]
        states = segment.trajectory.states(t, segment.coefficients)
        for name, there, here in zip("qva", stored, states, strict=True):
            off = np.inf if there.shape != here.shape else float(np.abs(there - here).max())
            if not off <= _SAME * float(np.abs(here).max(initial=1.0)):
                raise FileError(
                    f"{file}: the samples {name} of {segment.name} are not those of its "
                    "coefficients and config. Someone changed one of them: see `excite check`, "
                    "and plan the motion anew."
                )
