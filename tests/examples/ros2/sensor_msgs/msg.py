from array import array
from dataclasses import dataclass, field

from rclpy.duration import Stamp


@dataclass
class Header:
    """std_msgs/Header."""

    stamp: Stamp = field(default_factory=Stamp)
    frame_id: str = ""


def _numbers() -> array:
    return array("d")


@dataclass
class JointState:
    header: Header = field(default_factory=Header)
    name: list[str] = field(default_factory=list)
    position: array = field(default_factory=_numbers)
    velocity: array = field(default_factory=_numbers)
    effort: array = field(default_factory=_numbers)
