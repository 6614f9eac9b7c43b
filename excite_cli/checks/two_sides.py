"""Links of the left and the right that are no mirror images of each other.

Mass m and tr I, the sum of the moments of inertia about the centre of mass, are those of the
mirror image as well. Names tell the pairs: one word of the left's, changed into that of the right,
is the other's name (left_arm, l_arm, arm_L, LArm; FL_hip, LF_HIP).
"""

import re

import numpy as np

from excite_cli.checks.base import DescriptionCheck, Log
from excite_cli.checks.bodies import LinkBody, link_bodies
from excite_cli.checks.check_result import CheckResult, few

NAME = "left-right symmetry"
# Of 1,571 pairs of 106 descriptions 25 masses differ by more than 2 %, 37 inertias by this.
_FACTOR = 1.5
_COUNTS = 1e-3  # of all mass [kg/kg]: lighter links are placeholders
_DUST = 1e-5  # kg·m²: less is seen in no torque
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_RIGHT = {"left": "right", "l": "r"}
# Of legs, and only in front: lf may also be a little finger.
_RIGHT_LEG = {"fl": "fr", "rl": "rr", "hl": "hr", "bl": "br", "lf": "rf", "lh": "rh"}


class UnequalHalves(DescriptionCheck):
    """Links of the left beside those of the right."""

    name = NAME

    def look(self, log: Log) -> list[CheckResult]:
        """One doubt for all pairs whose masses or inertias differ by more than half."""
        robot = log.robot
        bodies = {body.name: body for body in link_bodies(robot)}
        least = _COUNTS * sum(body.mass for body in bodies.values())
        told = []
        for left in bodies.values():
            right = next((bodies[name] for name in _mirrored(left.name) if name in bodies), None)
            if right is not None and max(left.mass, right.mass) > least:
                told += _differences(left, right)
        if not told:
            return []
        text = (
            f"{few(told, '; ')}. Which side is right? Correct the other in the description, if the "
            "robot's two sides are alike"
        )
        return [CheckResult(NAME, "unequal_halves", "doubt", text)]


def _mirrored(name: str) -> list[str]:
    """What the link on the right may be called, for the name of one on the left."""
    found = []
    for word in _WORD.finditer(name):
        known = {**_RIGHT, **(_RIGHT_LEG if word.start() == 0 else {})}
        other = known.get(word[0].lower(), "")
        if other:
            case = str.upper if word[0].isupper() else str.title if word[0].istitle() else str
            found.append(name[: word.start()] + case(other) + name[word.end() :])
    return found


def _differences(left: LinkBody, right: LinkBody) -> list[str]:
    def unlike(a: float, b: float) -> bool:
        return max(a, b) > _FACTOR * min(a, b)

    names, traces = (
        f"{left.name} and {right.name}",
        [float(np.trace(x.inertia)) for x in (left, right)],
    )
    if unlike(left.mass, right.mass):
        return [f"{names} have {left.mass:.3g} and {right.mass:.3g} kg"]
    if max(traces) > _DUST and unlike(*traces):
        return [
            f"moments of inertia of {names} add up to {traces[0]:.3g} and {traces[1]:.3g} kg·m²"
        ]
    return []
