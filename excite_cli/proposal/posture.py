"""A posture to start from: one that others wrote down, bent and away from limits, then clear."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from excite_cli.proposal.limits import JointPlan

# Kept from limits, as a share of the range.
_INSIDE = 0.1
_BENT = ("elbow", "knee")
_BEND = 0.5


@dataclass(frozen=True)
class FirstPosture:
    """Joint values [rad or m] of moved joints, those of others, and where they come from."""

    moved: dict[str, float]
    others: dict[str, float]
    words: str


def first_posture(
    joints: Sequence[JointPlan], reference: tuple[str, str, Mapping[str, float]]
) -> FirstPosture:
    """The reference posture of an SRDF, else zero; elbows and knees bent, a tenth inside limits."""
    file, state, values = reference
    moved = {}
    for joint in joints:
        low = joint.lower + _INSIDE * joint.width
        high = joint.upper - _INSIDE * joint.width
        value = values.get(joint.name, 0.0)
        if joint.name not in values and any(word in joint.name.lower() for word in _BENT):
            value = _BEND if joint.upper >= -joint.lower else -_BEND
        moved[joint.name] = min(max(value, low), high)
    others = {name: value for name, value in values.items() if name not in moved and value}
    words = f"'{state}' of {file}" if values else "zero, elbows and knees bent"
    return FirstPosture(moved, others, f"{words}, a tenth of the range inside the limits")
