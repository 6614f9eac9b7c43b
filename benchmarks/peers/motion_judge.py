"""One judge for all contestants: limits, torques and meshes at 1 kHz, and both matrices."""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from benchmarks.peers.races import (
    ACCELERATION,
    JOINTS,
    LIMITS,
    OURS,
    OWN,
    Race,
    States,
    answered,
    package_folders,
    times_of,
)  # fmt: skip
from excite_cli import load_problem
from excite_cli.constraints.base import Array
from excite_cli.dynamics.regressor import InverseDynamics, Regressor
from excite_cli.excitation.admissible import smallest_margins
from excite_cli.excitation.invariant import invariants
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.mesh_check import MeshCheck

RATE = 1000.0
_SHARE_EVERY = 10  # share of samples in collision: at 100 Hz
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Verdict:
    """A motion at 1 kHz: what it breaks (in words), share of samples in collision, both matrices.

    `gap`: least distance of meshes [m]. `deviation`: of predicted torques, in units of the noise
    of a sample, whatever the columns.
    """

    broken: tuple[str, ...]
    colliding: float
    gap: float
    by_figaroh: float
    by_excite: float
    deviation: float


@dataclass(frozen=True)
class Judge:
    """The problem of a config, and what every motion is judged by.

    Limits are the full ones of FIGAROH's example, wider than what either program was asked for.
    """

    config: Path

    @cached_property
    def problem(self) -> Problem:
        return load_problem(self.config)

    @cached_property
    def _meshes(self) -> MeshCheck:
        return MeshCheck(self.problem.robot)

    @property
    def fine(self) -> Array:
        """Instants at 1 kHz, both ends included."""
        duration = self.problem.trajectory.duration
        return np.linspace(0.0, duration, round(duration * RATE) + 1)

    @property
    def cost(self) -> Array:
        """Instants of the cost."""
        return self.problem.cost_basis.times

    def states(self, coefficients: Array, times: Array) -> States:
        """A motion of ours at `times`."""
        return States(times, *self.problem.trajectory.states(times, coefficients))

    def keeps_config(self, coefficients: Array, self_collision: bool) -> bool:
        """Whether a motion of ours keeps every constraint of the config at 1 kHz."""
        least = smallest_margins(self.problem, coefficients, self.fine)
        return all(
            margin.min() >= 0.0
            for constraint, margin in zip(self.problem.constraints, least, strict=True)
            if self_collision or constraint.name not in ("self_collision", "mesh_clearance")
        )

    def condition_number(self, samples: States, columns: tuple[int, ...] | None) -> float:
        """Of the regressor's `columns`, or of our own, over the samples of the cost."""
        chosen = self.problem.base.selection if columns is None else np.array(columns)
        y = Regressor(self.problem.robot).evaluate(samples.q, samples.v, samples.a)
        return float(np.linalg.cond(y[:, :, chosen].reshape(-1, len(chosen))))

    @property
    def columns(self) -> tuple[int, ...]:
        """Columns of the regressor that this program calls base parameters."""
        return tuple(self.problem.base.selection.tolist())

    def deviation(self, samples: States) -> float:
        """RMS deviation of a torque predicted at random states within the limits."""
        y = Regressor(self.problem.robot).evaluate(samples.q, samples.v, samples.a)
        block = y[:, :, self.problem.base.selection].reshape(-1, self.problem.base.rank)
        stack = Stack.empty(self.problem.columns).with_rows(block * self.problem.column_scales)
        return invariants(self.problem, stack).torque_deviation

    def judge(self, race: Race, columns: tuple[int, ...] | None) -> Verdict | None:
        """The contestant's best motion; None where it has none."""
        fine, samples = race.fine, race.samples
        if fine is None or samples is None:
            return None
        used = self._used(fine)
        broken = [kind for kind, share in used.items() if share > 1.0 + _ROUNDING]
        gaps = self._meshes.least(fine.q)
        if gaps.broken:
            broken.append("self-collision")
        gap = min((each.distance for each in gaps.near), default=gaps.beyond)
        return Verdict(
            tuple(broken),
            self._colliding(fine.q[::_SHARE_EVERY]),
            max(gap, 0.0),
            self.condition_number(samples, columns),
            self.condition_number(samples, None),
            self.deviation(samples),
        )

    def _used(self, fine: States) -> dict[str, float]:
        """Largest share of the limit by kind."""
        limits = [LIMITS[name] for name in self.problem.robot.joint_names]
        assert self.problem.robot.joint_names == JOINTS
        bounds = {
            "position": np.array([limit["position"][1] for limit in limits]),
            "velocity": np.array([limit["velocity"] for limit in limits]),
            "acceleration": np.full(len(limits), ACCELERATION),
            "torque": np.array([limit["effort"] for limit in limits]),
        }
        torques = InverseDynamics(self.problem.robot).torques(fine.q, fine.v, fine.a)
        values = dict(zip(bounds, (fine.q, fine.v, fine.a, torques), strict=True))
        return {kind: float((np.abs(values[kind]) / bounds[kind]).max()) for kind in bounds}

    def _colliding(self, q: Array) -> float:
        """Share of the postures q (T, n) in which meshes of links that are not neighbours touch."""
        robot = self.problem.robot
        description = robot.description
        geometry = pin.buildGeomFromUrdfString(
            robot.model,
            description.xml,
            pin.GeometryType.COLLISION,
            None,
            package_folders(description),
        )
        objects = geometry.geometryObjects
        for i, first in enumerate(objects):
            for j in range(i):
                one, other = first.parentJoint, objects[j].parentJoint
                parents = robot.model.parents
                if one != other and parents[one] != other and parents[other] != one:
                    geometry.addCollisionPair(pin.CollisionPair(j, i))
        data, found = robot.model.createData(), geometry.createData()
        touching = [
            pin.computeCollisions(robot.model, data, geometry, found, posture, True)
            for posture in robot.configurations(q)
        ]
        return float(np.mean(touching))


# Of ours: gradient, self-collision, and whether FIGAROH's columns are taken for the cost.
CONTESTANTS = {
    OURS: ("exact", True, True),
    OWN: ("exact", True, False),
    "excite, finite differences": ("differences", True, True),
    "excite, self-collision off": ("exact", False, True),
}


def race_of_ours(judge: Judge, name: str, seed: int, columns: tuple[int, ...] | None) -> Race:
    """One motion of the judge's config; its curve has what the judge admits at 1 kHz only."""
    gradient, self_collision, by_peer = CONTESTANTS[name]
    request = {
        "config": str(judge.config),
        "overrides": [] if self_collision else ["constraints.self_collision=null"],
        "seed": seed,
        "gradient": gradient,
        "columns": columns if by_peer else None,
    }
    answer = answered([sys.executable, "-m", "benchmarks.peers.our_driver"], request)
    kept: list[Array] = []
    lowest = np.full(2, np.inf)
    for spent, coefficients in zip(answer["notes"], answer["coefficients"], strict=True):
        samples = judge.states(coefficients, judge.cost)
        values = np.array([judge.condition_number(samples, of) for of in (columns, None)])
        if (values < lowest).any() and judge.keeps_config(coefficients, self_collision):
            kept.append(np.concatenate([spent[:2], values]))
            lowest = np.minimum(lowest, values)
    final = answer.get("final")
    fine, samples = (
        None if final is None else judge.states(final, times) for times in (judge.fine, judge.cost)
    )
    return Race(
        name, seed, np.array(kept).reshape(-1, 4), *times_of(answer), fine, samples, columns,
        bool(answer["proved"]), {"says": str(answer["status"])},
    )  # fmt: skip
