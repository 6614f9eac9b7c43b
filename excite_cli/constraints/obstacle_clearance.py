"""Distances of the robot's capsules from what stands around it: floor, walls, boxes."""

from collections.abc import Iterable

import numpy as np

from excite_cli.config.constraints_spec import SurroundingsSpec
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.drawing import ConstraintScene, NearestBodies
from excite_cli.constraints.nearest_bodies import nearest_obstacles
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.mesh_distances import CoalDistances
from excite_cli.geometry.obstacle_pairs import (
    ObstacleDistances,
    ObstaclePairs,
    choose_obstacle_pairs,
)
from excite_cli.geometry.obstacles import Box, Obstacle, build_obstacles
from excite_cli.geometry.reasons import DroppedPair, Why, counted_reasons, reason_in_words
from excite_cli.proof.enclosed_distances import EnclosedCapsules, least_clearances
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot
from excite_cli.shown.note import Level, Note

# Distances beyond this many metres above the margin do not concern the optimiser.
_NEAR = 0.1
_TOLD = 4


class Surroundings(Constraint):
    """One column per checked pair of a capsule and an obstacle.

    `capsules`, `obstacles`: all there are; `pairs.checked` (capsule, obstacle) by their indices,
    one per column, the distances `pairs.kept` (m,) [m] they keep, and `pairs.dropped` with reasons.
    """

    name = "surroundings"
    title = "Nearest link and obstacle, less the margin"
    unit = "m"

    def __init__(
        self,
        robot: Robot,
        capsules: tuple[Capsule, ...],
        obstacles: tuple[Obstacle, ...],
        pairs: ObstaclePairs,
    ) -> None:
        self._robot = robot
        self.capsules, self.obstacles, self.pairs = capsules, obstacles, pairs
        self._distances = ObstacleDistances(robot, capsules, obstacles, pairs.checked)
        self.labels = tuple(f"{capsules[i].name} – {obstacles[j].name}" for i, j in pairs.checked)
        self.scale = np.full(len(self.labels), _NEAR)

    @classmethod
    def build(cls, spec: SurroundingsSpec, setting: Setting) -> Iterable[Constraint]:
        """Nothing where no link can reach them."""
        robot, capsules, obstacles = setting.robot, setting.capsules, build_obstacles(spec)
        pairs = choose_obstacle_pairs(robot, capsules, obstacles, spec, setting.bounded)
        return [cls(robot, capsules, obstacles, pairs)] if pairs.checked else []

    @property
    def left_out(self) -> tuple[DroppedPair, ...]:
        """Pairs of a capsule and an obstacle."""
        return self.pairs.dropped

    def capsules_of(self, column: int) -> tuple[Capsule, ...]:
        """The one that keeps away from an obstacle."""
        return (self.capsules[self.pairs.checked[column][0]],)

    @property
    def remarks(self) -> tuple[Note, ...]:
        """What is checked, what keeps less than the margin, and what touches at all times."""
        things = ", ".join(obstacle.name for obstacle in self.obstacles)
        said = [
            Note(
                Level.DETAIL,
                f"surroundings: {things}; {len(self.labels)} pairs of a capsule and an obstacle "
                f"checked; not checked: {counted_reasons(self.pairs.dropped)}",
            )
        ]
        most = float(self.pairs.kept.max())
        closer = [
            f"{label} {kept:.3f} m"
            for label, kept in zip(self.labels, self.pairs.kept, strict=True)
            if kept < most
        ]
        if closer:
            words = "these pairs are always near, so half of their largest distance is kept instead"
            said.append(Note(Level.INFO, f"{words} of {most:g} m: {'; '.join(closer)}"))
        touching = [
            f"{pair.first} – {pair.second} {reason_in_words(pair.reason)}"
            for pair in self.pairs.dropped
            if pair.reason.why is Why.ALWAYS_TOUCHING
        ]
        if touching:
            warning = (
                f"not guarded, since no motion parts them: {'; '.join(touching)}. Right "
                "for a robot that stands there; else correct constraints.surroundings."
            )
            said.append(Note(Level.WARNING, warning))
        return tuple(said)

    @property
    def drawing(self) -> ConstraintScene:
        """All capsules and all obstacles."""
        return ConstraintScene(self.capsules, self.obstacles)

    def nearest(self, poses: Poses, margins: Array) -> NearestBodies:
        """The nearest capsule and obstacle."""
        distances, bodies = margins + self.pairs.kept, (self.capsules, self.obstacles)
        return nearest_obstacles(poses, distances, self.labels, *bodies, self.pairs.checked)

    def independent_margins(self, states: States) -> Array:
        """By Pinocchio and coal."""
        coal = CoalDistances(self._robot, self.capsules, self.pairs.checked, self.obstacles)
        return coal.distances(states.q) - self.pairs.kept

    def margins(self, states: States) -> Array:
        """Distance less what is kept (T, m) [m]."""
        return self._distances.distances(states) - self.pairs.kept

    def margins_within(self, states: States, reach: Array) -> Array:
        """As `margins`; what is plainly farther away than `reach` gets a bound instead."""
        farthest = float((self.pairs.kept + reach).max(initial=0.0))
        return self._distances.distances(states, exact_below=farthest) - self.pairs.kept

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on distance less what is kept (T, m) [m]."""
        axes = EnclosedCapsules(self.capsules, motion)
        capsule, thing = np.array(self.pairs.checked, dtype=np.intp).T
        enough = float(self.pairs.kept.max())
        least = np.empty((motion.count, len(self.labels)))
        for index, obstacle in enumerate(self.obstacles):
            columns = np.flatnonzero(thing == index)
            least[:, columns] = least_clearances(axes, obstacle, capsule[columns], enough)
        return least - self.pairs.kept

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Normal of the obstacle times the Jacobian of the witness point on the capsule's axis."""
        return self._distances.gradients(states, times, columns), None, None

    def why_not(self, states: States) -> str:
        """Which capsules are inside an obstacle, and how deep, deepest first."""
        distances = self._distances.distances(states)[0]
        inside = [int(k) for k in np.argsort(distances) if distances[k] < 0]
        if not inside:
            return ""
        words = []
        for column in inside[:_TOLD]:
            i, j = self.pairs.checked[column]
            place = self.obstacles[j].in_words(-float(distances[column]))
            words.append(f"{self.capsules[i].name} is {place}")
        more = f" and {len(inside) - _TOLD} more pairs" if len(inside) > _TOLD else ""
        things = {
            self.pairs.checked[k][1]: self.obstacles[self.pairs.checked[k][1]] for k in inside
        }
        names = ", ".join(thing.name for thing in things.values())
        boxes = any(isinstance(thing, Box) for thing in things.values())
        hint = " (the position of a box is its centre)" if boxes else ""
        return (
            f"{', '.join(words)}{more}. Give another robot.posture, or correct {names} in "
            f"constraints.surroundings{hint}; a pair that may touch goes into "
            "constraints.surroundings.ignore"
        )
