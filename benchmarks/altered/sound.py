"""Sound recordings, of which nothing should be said: simulated campaigns, and real robots.

Campaigns are those of the battery: several robots, series and short moves, payloads, friction that
changes, noise with and without memory, encoders of 17 to 21 bits. Every third one has encoders of
15 bits and torques in steps of a hundredth of their largest.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.altered.recordings import CONFIGS, REAL, recording
from benchmarks.battery.campaigns import make_case
from benchmarks.battery.judge import data_of
from excite_cli.api.loading import Case
from excite_cli.measurement.dataset import Dataset, Run

_COUNT = 2 * np.pi / 2**15
_STEP = 0.01  # of the largest torque of a joint
# Faults of packets are in some campaigns, and told rightly; so is what is wrong of descriptions
# (the first link of a Panda spreads over twice its size), and a base that leans.
TRUE = frozenset({
    "stale", "bridged", "jitter", "gap", "short_part", "outside_shape", "inertia_frame",
    "unequal_halves", "density", "zero_velocity", "zero_effort",
})  # fmt: skip


@dataclass(frozen=True)
class Sound:
    """A recording as it is, the config for it, and the run that is held out."""

    name: str
    case: Case
    data: Dataset
    held_out: str | None = None
    leans: bool = False


def sound_logs(simulated: int, seed: int) -> Iterator[Sound]:
    """Recordings of real robots, whole and run by run, then campaigns."""
    for name in REAL:
        of = recording(name)
        yield Sound(name, of.case, of.data, leans=name == "med7")
        for run in of.data.runs if len(of.data.runs) > 1 else ():
            yield Sound(f"{name} {run.name}", of.case, replace(of.data, runs=(run,)))
    for index in range(simulated):
        case = make_case(seed, index)
        data = data_of(case).dataset
        coarse = index % 3 == 0
        if coarse:
            data = replace(data, runs=tuple(map(_coarse, data.runs)))
        name = f"{index} {case.group} {case.robot.name}{' coarse' if coarse else ''}"
        leans = any("base_tilt" in plant.kinds for plant in case.plants)
        own = Case(case.spec, CONFIGS, case.robot.robot)
        yield Sound(name, own, data, case.held_out, leans)


def _coarse(run: Run) -> Run:
    step = _STEP * np.abs(run.tau).max(axis=0)
    return replace(
        run, q=_COUNT * np.round(run.q / _COUNT), tau=step * np.round(run.tau / step), dq=run.dq
    )
