"""Pinocchio's model of a URDF, and the same with joints locked."""

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import RobotError
from excite_cli.robot.description import RobotDescription, require_limits

_LINK = " (link)"


def parsed_model(description: RobotDescription, spec: RobotSpec) -> pin.Model:
    """All joints of the URDF on the base that `spec` asks for.

    Raises
    ------
    RobotError
        Pinocchio cannot use it, or no joint moves.
    """
    require_limits(description)  # the parser would tell it to the terminal, not to us
    try:
        if spec.base == "floating":
            model = pin.buildModelFromXML(description.xml, pin.JointModelFreeFlyer())
        else:
            rotation = pin.rpy.rpyToMatrix(*spec.base_orientation)
            model = pin.buildModelFromXML(description.xml)
            if any(spec.base_orientation):
                _turn_base(model, rotation)
    except (RuntimeError, ValueError) as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else "no reason given"
        raise RobotError(f"{description.path} is not a URDF that can be used: {first}") from error
    if model.nv - (6 if spec.base == "floating" else 0) < 1:
        raise RobotError(f"{description.path} has no movable joint.")
    return model


def _turn_base(model: pin.Model, rotation: Array) -> None:
    turn = pin.SE3(rotation, np.zeros(3))
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = turn * model.jointPlacements[joint]
    model.inertias[0] = model.inertias[0].se3Action(turn)
    for frame in model.frames:
        if frame.parentJoint == 0:
            frame.placement = turn * frame.placement


def reduced_model(full: pin.Model, locked: list[int], reference: Array) -> pin.Model:
    """The model with joints locked at `reference`.

    Pinocchio finds a joint's frame by its name, which a link may have too: such links have another
    name meanwhile.
    """
    joints = {str(name) for name in full.names}
    for frame in full.frames:
        if frame.type == pin.FrameType.BODY and str(frame.name) in joints:
            frame.name = f"{frame.name}{_LINK}"
    model = pin.buildReducedModel(full, locked, reference)
    for frame in model.frames:
        frame.name = str(frame.name).removesuffix(_LINK)
    return model
