"""Clearance of a motion: distances of the checked pairs of capsules."""

from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot


class Clearance(PairDistances):
    """Signed distances [m] of the checked pairs, column k being `pairs.checked[k]`.

    `names` gives the two capsules of each column, for messages and reports.
    """

    def __init__(self, robot: Robot, capsules: tuple[Capsule, ...], pairs: CollisionPairs) -> None:
        super().__init__(robot, capsules, pairs.checked)
        self.names = tuple((capsules[i].name, capsules[j].name) for i, j in pairs.checked)
