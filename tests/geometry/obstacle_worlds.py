"""Random capsules on random robots among random things, and coal's distances of them."""

import coal
import numpy as np
import pinocchio as pin

from excite_cli.geometry.obstacles import Box, Obstacle, Plane
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Array, Robot


def random_capsules(rng: np.random.Generator, robot: Robot) -> tuple[Capsule, ...]:
    """One for every joint, the world's too; every third is a sphere."""
    found = []
    for joint in range(robot.model.njoints):
        start = rng.uniform(-0.2, 0.2, 3)
        end = start if joint % 3 == 2 else start + rng.uniform(-0.4, 0.4, 3)
        name = f"capsule_{joint}"
        found.append(Capsule(name, joint, start, end, float(rng.uniform(0.02, 0.1)), (name,)))
    return tuple(found)


def random_obstacles(rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """A floor, a slanted wall, a level table and a turned box."""
    normal = rng.normal(size=3)
    turn = np.array(pin.rpy.rpyToMatrix(*rng.uniform(-3, 3, 3)))
    return (
        Plane("floor", np.array([0.0, 0.0, 1.0]), -0.3),
        Plane("wall", normal / np.linalg.norm(normal), -0.5),
        Box("table", np.eye(3), np.array([0.5, 0.0, -0.2]), np.array([0.5, 0.4, 0.05])),
        Box("box", turn, rng.uniform(-0.5, 0.5, 3), rng.uniform(0.1, 0.4, 3)),
    )


def coal_distance(capsule: Capsule, place: pin.SE3, obstacle: Obstacle) -> float:
    """Signed distance [m] of a capsule, whose joint stands at `place`, by coal."""
    along = capsule.end - capsule.start
    length = float(np.linalg.norm(along))
    turn = np.eye(3)
    if length > 0:
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).matrix()
    world = place * pin.SE3(turn, (capsule.start + capsule.end) / 2)
    shape = coal.Capsule(capsule.radius, length)
    if isinstance(obstacle, Box):
        thing = coal.Box(*(2 * obstacle.half))
        other = coal.Transform3s(obstacle.rotation, obstacle.position)
    else:
        assert isinstance(obstacle, Plane)
        thing = coal.Halfspace(obstacle.normal, obstacle.offset)
        other = coal.Transform3s.Identity()
    return float(
        coal.distance(
            shape,
            coal.Transform3s(world.rotation, world.translation),
            thing,
            other,
            coal.DistanceRequest(),
            coal.DistanceResult(),
        )
    )


def coal_distances(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    obstacles: tuple[Obstacle, ...],
    pairs: list[tuple[int, int]],
    q: Array,
) -> Array:
    """Signed distances (T, P) [m] at q (T, n)."""
    data = robot.model.createData()
    found = np.empty((len(q), len(pairs)))
    for t, configuration in enumerate(robot.configurations(q)):
        pin.forwardKinematics(robot.model, data, configuration)
        for k, (i, j) in enumerate(pairs):
            place = data.oMi[capsules[i].joint]
            found[t, k] = coal_distance(capsules[i], place, obstacles[j])
    return found
