from dataclasses import dataclass


@dataclass
class JointTolerance:
    name: str = ""
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0
