"""How far a robot reaches: what no capsule given by hand can sensibly exceed."""

import numpy as np
import pinocchio as pin

from excite_cli.errors import ConfigError
from excite_cli.robot.capsule import Capsule

_LONGEST = 4.0  # times the reach: a pole or a beam may be longer than the robot that holds it
_LEAST = 0.5  # [m] asked of no robot to be smaller: a URDF of one joint may have no length at all


def reach(model: pin.Model) -> float:
    """Largest length [m] of a chain from the base to a frame or a body's centre of mass.

    Translations along the chain are added up whatever their directions, with the strokes of
    prismatic joints that have limits.
    """
    along = np.zeros(model.njoints)
    for joint in range(1, model.njoints):
        along[joint] = along[model.parents[joint]] + _norm(model.jointPlacements[joint])
        if "JointModelP" in model.joints[joint].shortname():
            index = model.joints[joint].idx_q
            ends = (model.lowerPositionLimit[index], model.upperPositionLimit[index])
            along[joint] += max(abs(end) for end in (0.0, *ends) if np.isfinite(end))
    frames = [along[frame.parentJoint] + _norm(frame.placement) for frame in model.frames]
    bodies = along + [float(np.linalg.norm(inertia.lever)) for inertia in model.inertias]
    return float(max([*frames, *bodies]))


def check_size(model: pin.Model, capsule: Capsule, where: str) -> None:
    """Refuse a capsule out of all proportion: proofs would pass over it as always touching.

    Raises
    ------
    ConfigError
        Its radius exceeds the robot's reach, or its length four times that.
    """
    most = max(reach(model), _LEAST)
    length = float(np.linalg.norm(capsule.end - capsule.start))
    for what, size, allowed, why in (
        ("radius", capsule.radius, most, "as far as the robot reaches"),
        ("distance of its ends", length, _LONGEST * most, f"{_LONGEST:g} times the robot's reach"),
    ):
        if size > allowed:
            raise ConfigError(
                f"{where}: a {what} of {size:g} m is larger than {allowed:.2g} m, {why}. Lengths "
                "are in metres."
            )


def _norm(placement: pin.SE3) -> float:
    return float(np.linalg.norm(placement.translation))
