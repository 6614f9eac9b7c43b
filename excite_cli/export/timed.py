"""From a chain of trajectories to instants with q, v, a, as controllers take them."""

import numpy as np

from excite_cli.errors import ConfigError
from excite_cli.measurement.dataset import Array
from excite_cli.motion_formats.timed_motion import TimedMotion
from excite_cli.trajectory.fade import Chain, Segment

MAX_INSTANTS, MAX_PERIODS = 2_000_000, 10_000
# How far q, v, a may be apart at both ends of a motion that is repeated [rad, rad/s, rad/s²].
_CLOSED = 1e-6


def timed_motion(
    name: str,
    joint_names: tuple[str, ...],
    chain: Chain,
    rate: float,
    equidistant: bool = False,
    whole_nanoseconds: bool = False,
) -> TimedMotion:
    """The chain at `instants`, q, v, a exact there.

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
