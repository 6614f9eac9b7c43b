"""A robot that stands on links of its own, given as if it hung from its base.

Ground that carries a robot at some of its ends does to the joints what bodies of negative mass
there would: −f/g each, together about as heavy as all of it. Upward forces that are constant
explain most of what the URDF then leaves of the torques, and of a robot that hangs none of that.
"""

from itertools import combinations

import numpy as np
from scipy.optimize import nnls

from excite_cli.checks.check_result import CheckResult
from excite_cli.checks.setup import Samples
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.robot.link_frame import leaves, own_link
from excite_cli.robot.model import Array, Robot

NAME = "what supports the robot"
_LEFT = 0.4  # of the energy of what the URDF leaves that upward forces may leave
_WEIGHT = 0.5, 1.5  # of the robot, that they carry together
_MOST_FEET = 4


def standing_legs(robot: Robot, samples: Samples) -> list[CheckResult]:
    """A fault where torques are those of a robot that stands on links of its own."""
    ends = leaves(robot)
    if robot.base_joints or len(ends) < 2 or not samples.known.any():
        return []
    body = RigidBody(robot, standard_parameters(robot), samples.q, samples.v, samples.a)
    rest = np.where(samples.known, samples.tau - body.load, 0.0)
    whole = float(np.sum(rest**2))
    carried = _held(robot, samples, ends)
    mass = float(sum(each.mass for each in robot.model.inertias))
    best, held = whole, np.zeros(0)
    feet: tuple[int, ...] = ()
    for count in range(1, min(_MOST_FEET, len(ends)) + 1):
        for some in combinations(range(len(ends)), count):
            found, left = nnls(carried[:, list(some)], rest.ravel())
            if left**2 < 0.9 * best:  # one more end must be worth it
                best, feet, held = float(left**2), some, found
    explains = bool(whole) and best <= _LEFT * whole
    if not (explains and _WEIGHT[0] * mass < held.sum() < _WEIGHT[1] * mass):
        return []
    links = [own_link(robot, ends[k]).name for k in feet]
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    forces = ", ".join(
        f"{f * gravity:.3g} N at {link}" for f, link in zip(held, links, strict=True)
    )
    text = (
        f"these are torques of a robot that stands on {' and '.join(links)}, not of one that hangs "
        f"or is bolted down: upward forces there ({forces}; it weighs {mass * gravity:.3g} N) "
        f"explain {1 - best / whole:.0%} of what the URDF leaves. Declare robot.base: floating, "
        "robot.rows: [base, joints] and the forces measured there (measurement.wrench), or leave "
        f"the joints that carry it out of robot.joints; measurement.trust: [{NAME}] takes them as "
        "they are"
    )
    return [CheckResult(NAME, "standing", "fault", text)]


def _held(robot: Robot, samples: Samples, ends: tuple[int, ...]) -> Array:
    """What 1 kg that is carried from outside at each end takes off the torques, (T n, ends)."""
    still = np.zeros_like(samples.q)
    columns = RigidBody(robot, standard_parameters(robot), samples.q, still, still).regressor
    masses = [PARAMETERS_PER_BODY * (robot.model_joints[j] - 1) for j in ends]
    taken = np.where(samples.known[:, :, None], -columns[:, :, masses], 0.0)
    return taken.reshape(-1, len(ends))
