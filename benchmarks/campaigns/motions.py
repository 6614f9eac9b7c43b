"""Motions of a campaign: Fourier series of 4–10 s, or short moves with rests between them.

Several series are drawn for a run and the best conditioned one is taken, so that parameters are
known about as well as from planned motions. Short moves are those that people record: from point to
point in 0.5–2 s with rests, and in each move some of the joints stand.
"""

import numpy as np

from benchmarks.battery.motions import Arm
from benchmarks.campaigns.robots import joint_limits
from excite_cli.dynamics.regressor import Regressor
from excite_cli.robot.model import Array
from excite_cli.simulation.planned_motion import Planned, PlannedMotion, PlannedProgram
from excite_cli.trajectory.fade import Chain, Segment
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.point_to_point import PointToPoint, at_rest_between

_HARMONICS = 5
_ACCELERATION = 8.0  # rad/s²
_DRAWS = 6
_GRID = 60
_AGAIN = 0.3  # of the runs repeat the motion of an earlier one
_STANDING = 0.4  # of the joints in a short move
# Peaks of a move of degree five from rest to rest: speed by distance/time, acceleration by its.
_PEAK_SPEED, _PEAK_PUSH = 1.875, 5.774


def series(of: Arm, names: tuple[str, ...], rng: np.random.Generator) -> tuple[Planned, ...]:
    """A well conditioned Fourier motion for every run; some runs repeat one."""
    found: list[PlannedMotion] = []
    seconds = float(rng.uniform(4.0, 8.0))
    for name in names:
        if len(found) > 1 and rng.uniform() < _AGAIN:
            again = found[rng.integers(len(found))]
            found.append(PlannedMotion(name, again.trajectory, again.coefficients))
            continue
        trajectory = FourierTrajectory(_HARMONICS, 2 * np.pi / (seconds * rng.uniform(1.0, 1.2)))
        drawn = [_waves(of, trajectory, rng) for _ in range(_DRAWS)]
        best = min(drawn, key=lambda each: _condition(of, trajectory, each))
        found.append(PlannedMotion(name, trajectory, best))
    return tuple(found)


def short_moves(of: Arm, names: tuple[str, ...], rng: np.random.Generator) -> tuple[Planned, ...]:
    """A program of moves and rests, 5–10 s long, for every run."""
    return tuple(PlannedProgram(name, _moves(of, rng)) for name in names)


def _condition(of: Arm, trajectory: FourierTrajectory, coefficients: Array) -> float:
    times = np.arange(_GRID) * trajectory.duration / _GRID
    states = trajectory.basis(times).states(coefficients)
    y = Regressor(of.robot).evaluate(*states)[:, :, of.base.selection].reshape(-1, of.base.rank)
    return float(np.linalg.cond(y / np.maximum(np.linalg.norm(y, axis=0), 1e-12)))


def _waves(of: Arm, trajectory: FourierTrajectory, rng: np.random.Generator) -> Array:
    """Random series about a random centre, every joint scaled to its own limits."""
    n = of.robot.n
    lower, upper, fastest = joint_limits(of.robot)
    falling = np.arange(1, _HARMONICS + 1) ** -rng.uniform(0.3, 1.3)
    shape = np.vstack(
        [rng.normal(size=(2 * _HARMONICS, n)) * np.tile(falling, 2)[:, None], np.zeros((1, n))]
    )
    q, v, a = trajectory.basis(np.arange(300) * trajectory.duration / 300).states(shape)
    highest, lowest = q.max(axis=0), q.min(axis=0)
    room = (upper - lower) / np.maximum(highest - lowest, 1e-12)
    speed, push = fastest / np.abs(v).max(axis=0), _ACCELERATION / np.abs(a).max(axis=0)
    scale = np.min([room, speed, push], axis=0) * rng.uniform(0.6, 0.9, n)
    shape *= scale
    shape[-1] = rng.uniform(lower - scale * lowest, upper - scale * highest)
    return shape


def _moves(of: Arm, rng: np.random.Generator) -> Chain:
    lower, upper, fastest = joint_limits(of.robot)
    middle, half = (upper + lower) / 2, 0.45 * (upper - lower)
    at = middle + half * rng.uniform(-1.0, 1.0, of.robot.n)
    wanted, spent = float(rng.uniform(5.0, 10.0)), 0.0
    segments: list[Segment] = []
    while spent < wanted:
        seconds, rest = float(rng.uniform(0.5, 2.0)), float(rng.uniform(0.2, 1.0))
        stands = rng.uniform(size=of.robot.n) < _STANDING
        stands[rng.integers(of.robot.n)] = False
        step = middle + half * rng.uniform(-1.0, 1.0, of.robot.n) - at
        largest = np.minimum(
            fastest * seconds / _PEAK_SPEED, _ACCELERATION * seconds**2 / _PEAK_PUSH
        )
        to = at + np.where(stands, 0.0, np.clip(step, -largest, largest))
        segments.append(Segment("move", PointToPoint(seconds, True), at_rest_between(at, to)))
        segments.append(Segment("rest", PointToPoint(rest, True), at_rest_between(to, to)))
        at, spent = to, spent + seconds + rest
    return Chain(tuple(segments))
