"""The record of one capsule: all points within a radius of a segment."""

from dataclasses import dataclass

from excite_cli.arrays import Array


@dataclass(frozen=True, eq=False)
class Capsule:
    """A capsule carried by a joint of `robot.model`.

    name: link it stands for; further capsules of the same link are `link#2`, `link#3`.
    joint: index in `robot.model`; 0 is fixed to the world.
    start, end: (3,) ends of the segment [m] in the joint frame, equal for a sphere; radius [m].
    links: all links it contains, `name` without number first.
    by_hand: given in the config, not fitted to collision geometry.
    """

    name: str
    joint: int
    start: Array
    end: Array
    radius: float
    links: tuple[str, ...]
    by_hand: bool = False
