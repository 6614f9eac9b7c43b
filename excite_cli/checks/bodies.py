"""Links of a description that cannot be bodies, or whose masses cannot be meant.

A body has a positive mass, and moments of inertia about its centre that are positive, of which two
are at least as large as the third (I₁ + I₂ ≥ I₃): no density makes others.
"""

import numpy as np

from excite_cli.checks.link_bodies import link_bodies
from excite_cli.checks.result import Result, Status
from excite_cli.robot.model import Array, Robot

NAME = "bodies of the description"
_ROUNDED = 0.02  # share by which rounded figures of a URDF may break the triangle's inequality
_DUST = 1e-5  # kg·m²: of a sensor's housing, which no torque shows
_LARGE = 5.0  # radius of gyration over the distance to the farthest joint of the link
_SHORTEST = 0.15  # m, of a link that carries no joint


def bodies_in_words(robot: Robot) -> str:
    """What to know of the description's bodies, in one sentence; empty where all can be."""
    return "; ".join(each.evidence for each in impossible_bodies(robot))


def impossible_bodies(robot: Robot) -> list[Result]:
    """A fault for links that no body is like; a doubt for those that hardly any is."""
    found = []
    for body in link_bodies(robot):
        moments: Array = np.linalg.eigvalsh(body.inertia).astype(float)
        if body.mass >= 0.0 and np.abs(moments).max() < _DUST:
            continue
        reach = max(_SHORTEST, float(np.linalg.norm(body.joints, axis=1).max()))
        said = _judged(body.mass, moments, reach)
        if said is not None:
            status, why = said
            text = f"{body.name} cannot be a body: {why}"
            if status == "doubt":
                text = f"{body.name} is hardly a body: {why}"
            found.append(Result(NAME, "impossible_body", status, text))
    return found


def _judged(mass: float, moments: Array, reach: float) -> tuple[Status, str] | None:
    told = ", ".join(f"{x:.3g}" for x in moments)
    if mass < 0.0:
        return "fault", f"its mass is {mass:.4g} kg. Correct it in the description"
    if mass == 0.0:
        return "doubt", (
            f"its moments of inertia are {told} kg·m², and its mass is 0. Give it one, or leave "
            "<inertial> out"
        )
    if moments[0] < -1e-9 - _ROUNDED * abs(moments[-1]):
        return "fault", (
            f"its moments of inertia are {told} kg·m² about its centre, and none may be negative. "
            "Correct them in the description"
        )
    if moments[0] + moments[1] < (1.0 - _ROUNDED) * moments[2] - 1e-9:
        return "doubt", (
            f"its moments of inertia are {told} kg·m² about its centre, of which no two may be "
            "less than the third. Are they about another frame, or another unit?"
        )
    gyration = float(np.sqrt(moments[-1] / mass)) if mass > 1e-3 else 0.0
    if gyration > _LARGE * reach:
        return "doubt", (
            f"moments of inertia of up to {moments[-1]:.3g} kg·m² with {mass:.3g} kg are those of "
            f"a body {2 * gyration:.2g} m wide; its joints span {reach:.2g} m. Are they in "
            "another unit (kg·mm²), or about another frame?"
        )
    return None
