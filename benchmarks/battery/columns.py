"""Logs with further columns: a temperature that friction or an offset follows, and decoys.

A campaign takes 40 minutes. The temperature rises, falls while the robot pauses, and rises again;
what has nothing to do with the robot drifts, jumps, or rises all the time. Friction is a straight
line over its column or, in a part of the cases, thins as exp(−c), which no kind of the catalogue is
exactly.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from benchmarks.battery.changes import Scene, shows
from benchmarks.battery.outside import Thinning
from benchmarks.battery.scoring import Plant
from benchmarks.battery.sizes import Ground
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.model import Array
from excite_cli.simulation.covariate_series import CovariateSeries
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.planned_motion import Planned

MINUTES = 40.0
FOLLOWED = "temperature"
_DECOYS = ("ambient", "humidity", "supply", "fan")
_CHANGE = (0.3, 0.6)  # of the friction, over the column's range
_OFFSET = (0.03, 0.12)  # of the joint's torque, over the column's range
_THINNING = 0.3  # of the cases of friction


def pause_of(motions: Sequence[Planned]) -> float:
    """Seconds between recordings, so that the campaign takes its minutes."""
    played = sum(motion.duration for motion in motions)
    return (60.0 * MINUTES - played) / max(len(motions) - 1, 1)


def drawn_series(rng: np.random.Generator) -> tuple[CovariateSeries, ...]:
    """The temperature first, then one to three columns that nothing follows."""
    clock = np.linspace(0.0, 60.0 * MINUTES, 13)
    courses = {FOLLOWED: _warm_and_cool(clock, rng)}
    for name in rng.choice(_DECOYS, int(rng.integers(1, 4)), replace=False):
        courses[str(name)] = _decoy(clock, rng)
    return tuple(
        CovariateSeries(
            name,
            tuple(clock.tolist()),
            tuple(course.tolist()),
            float(rng.uniform(0.002, 0.02) * np.ptp(course)),
        )
        for name, course in courses.items()
    )


def _warm_and_cool(clock: Array, rng: np.random.Generator) -> Array:
    """First order towards a level that is high while the robot works, low while it pauses."""
    ambient, hot = rng.uniform(15.0, 25.0), rng.uniform(35.0, 55.0)
    constant = rng.uniform(300.0, 1200.0)
    paused = rng.uniform(0.35, 0.6) * clock[-1]
    until = paused + rng.uniform(0.15, 0.3) * clock[-1]
    values = [float(rng.uniform(ambient, ambient + 5.0))]
    for before, after in pairwise(clock):
        level = ambient if paused <= before < until else hot
        share = -np.expm1(-(after - before) / constant)
        values.append(values[-1] + share * (level - values[-1]))
    return np.array(values)


def _decoy(clock: Array, rng: np.random.Generator) -> Array:
    """A random walk, a slow wave, a rise, or another warming up with its own pauses."""
    x = clock / clock[-1]
    shape = int(rng.integers(4))
    if shape == 0:
        course = np.cumsum(rng.normal(size=len(x)))
    elif shape == 1:
        course = np.sin(2 * np.pi * (rng.uniform(1.0, 3.0) * x + rng.uniform()))
    elif shape == 2:
        course = x + 0.1 * rng.normal(size=len(x))
    else:
        course = _warm_and_cool(clock, rng)
    return rng.uniform(10.0, 60.0) + rng.uniform(1.0, 20.0) * course / max(np.ptp(course), 1e-9)


def with_columns(
    ground: Ground, motions: Sequence[Planned], series: Sequence[CovariateSeries]
) -> Ground:
    """The ground with what the columns are while each motion is played."""
    starts, start, pause = [], 0.0, pause_of(motions)
    for motion in motions:
        starts.append(start)
        start += motion.duration + pause
    signals = tuple(
        replace(s, start=start, covariates={each.name: each.at(start + s.t) for each in series})
        for s, start in zip(ground.signals, starts, strict=True)
    )
    return replace(ground, signals=signals)


def friction_by_column(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """Coulomb friction, viscous friction or both fall, or rise, with the temperature."""
    j = int(rng.integers(scene.of.robot.n))
    which = np.array(((1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 1.0))[rng.integers(4)])
    middle, width = _range(scene)
    change = rng.uniform(*_CHANGE) * (1.0 if rng.uniform() < 0.8 else -1.0)
    friction = which * scene.friction[:, j]
    if rng.uniform() < _THINNING:
        rate = -np.log1p(-abs(change)) / width
        effect: Effect = Thinning((j,), {"reference": middle, "rate": rate}, (), FOLLOWED)
        values, sizes = friction, {}
    else:
        kind = kind_named("covariate_friction")
        effect = kind((j,), {"reference": middle}, (), FOLLOWED)
        values = -change / width * friction
        named = zip(("coulomb_slope", "viscous_slope"), map(float, values), strict=True)
        sizes = {name: value for name, value in named if value}
    planted = PlantedEffect(effect, values)
    if not shows(scene, [planted]):
        return None
    return Plant(
        ("covariate_friction",), scene.names((j,)), (planted,), sizes=sizes, covariate=FOLLOWED
    )


def offset_by_column(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """The zero of a torque sensor drifts with the temperature."""
    j = int(rng.integers(scene.of.robot.n))
    middle, width = _range(scene)
    size = rng.uniform(*_OFFSET) * scene.ground.torque[j] / width * rng.choice([-1.0, 1.0])
    effect = kind_named("covariate_offset")((j,), {"reference": middle}, (), FOLLOWED)
    planted = PlantedEffect(effect, np.array([size]))
    if not shows(scene, [planted]):
        return None
    sizes = {"offset_slope": float(size)}
    return Plant(
        ("covariate_offset",), scene.names((j,)), (planted,), sizes=sizes, covariate=FOLLOWED
    )


def _range(scene: Scene) -> tuple[float, float]:
    """Mean of the temperature in the training runs, and how far it goes there."""
    seen = [s.covariates[FOLLOWED] for s in scene.ground.signals if s.run.is_among(scene.training)]
    return float(np.mean([each.mean() for each in seen])), float(np.ptp(np.concatenate(seen)))
