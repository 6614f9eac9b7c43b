"""Robots of the battery, and well exciting random motions for them.

A pool of random Fourier motions is made for every robot and seed: each is scaled until its most
demanding joint limit (position, speed, acceleration) is used to 60–90 % on every joint, and those
with the lowest condition number of the base regressor are kept. Collisions are not looked at: the
simulated robot has none.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.load_spec import load_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters, base_parameters_as_given
from excite_cli.dynamics.regressor import Regressor
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.trajectory.fourier import FourierTrajectory

CONFIGS = Path(__file__).parents[2] / "configs"
ROBOTS = ("ur10", "panda", "talos_arms")
ACCELERATION = {"ur10": 10.0, "panda": 7.5, "talos_arms": 10.0}  # rad/s²
HARMONICS, SECONDS = 5, 10.0
FRICTION = (EffectSpec(kind="viscous_friction"), EffectSpec(kind="coulomb_friction"))
_DRAWS, _KEPT = 40, 10
_GRID = 80  # instants at which limits and regressor are evaluated


@dataclass(frozen=True)
class Arm:
    """A robot with its base parameters and its shipped configuration."""

    name: str
    robot: Robot
    base: BaseParameters
    spec: Spec


@cache
def arm(name: str) -> Arm:
    """The robot of a shipped config by its stem."""
    path = CONFIGS / f"{name}.yaml"
    spec = load_spec(path, [])
    robot = build_robot(spec.robot, path.parent)
    # Columns as LAPACK takes them: the pool is ordered by their condition number, and motions stay
    # those of earlier runs of the battery.
    return Arm(name, robot, base_parameters_as_given(robot), spec)


@cache
def pool(name: str, seed: int) -> tuple[Array, ...]:
    """Coefficients of the best motions of a robot, the best conditioned first."""
    of = arm(name)
    rng = np.random.default_rng([seed, 71, ROBOTS.index(name)])
    regressor = Regressor(of.robot)
    basis = trajectory().basis(np.arange(_GRID) * SECONDS / _GRID)
    drawn = []
    for _ in range(_DRAWS):
        coefficients = _draw(of, rng)
        y = regressor.evaluate(*basis.states(coefficients))[:, :, of.base.selection]
        drawn.append((float(np.linalg.cond(y.reshape(-1, of.base.rank))), coefficients))
    drawn.sort(key=lambda each: each[0])
    return tuple(coefficients for _, coefficients in drawn[:_KEPT])


def four_motions(name: str, seed: int, rng: np.random.Generator) -> tuple[PlannedMotion, ...]:
    """Four different motions of the pool, `motion_1` to `motion_4`."""
    best = pool(name, seed)
    chosen = rng.permutation(len(best))[:4]
    return tuple(
        PlannedMotion(f"motion_{k}", trajectory(), best[i]) for k, i in enumerate(chosen, start=1)
    )


def trajectory() -> FourierTrajectory:
    return FourierTrajectory(HARMONICS, 2 * np.pi / SECONDS)


def _draw(of: Arm, rng: np.random.Generator) -> Array:
    push = np.minimum(of.robot.limits.acceleration, ACCELERATION[of.name])
    return waves(of, trajectory(), 400, of.robot.limits.velocity, push, rng)


def waves(
    of: Arm, along: FourierTrajectory, instants: int, fastest: Array, push: Array | float,
    rng: np.random.Generator,
) -> Array:  # fmt: skip
    """Random series about a random centre, every joint scaled to its own limits."""
    n = of.robot.n
    lower, upper = (np.clip(x, -np.pi, np.pi) for x in of.robot.limits.ranges())
    falling = np.arange(1, HARMONICS + 1) ** -rng.uniform(0.3, 1.3)
    drawn = rng.normal(size=(2 * HARMONICS, n)) * np.tile(falling, 2)[:, None]
    shape = np.vstack([drawn, np.zeros((1, n))])
    q, v, a = along.basis(np.arange(instants) * along.duration / instants).states(shape)
    highest, lowest = q.max(axis=0), q.min(axis=0)
    room = (upper - lower) / np.maximum(highest - lowest, 1e-12)
    speed, push = fastest / np.abs(v).max(axis=0), push / np.abs(a).max(axis=0)
    scale = np.min([room, speed, push], axis=0) * rng.uniform(0.6, 0.9, n)
    shape *= scale
    shape[-1] = rng.uniform(lower - scale * lowest, upper - scale * highest)  # keeps the limits
    return shape
