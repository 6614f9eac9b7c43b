"""A rigid payload: its inertia, added to the body that carries it, and the capsule around it."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.config.robot_spec import PayloadSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.reach import check_size

Array = NDArray[np.float64]

PAYLOAD = "payload"
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class CarriedPayload:
    """What `link` carries.

    capsule: in the frame of the joint that carries the link, by the name `payload`.
    phi: (10,) its standard parameters about that frame; part of what the model has there.
    """

    link: str
    capsule: Capsule
    phi: Array

    @property
    def in_words(self) -> str:
        """`2 kg on tool0`."""
        return f"{self.phi[0]:g} kg on {self.link}"


def payload_on(model: pin.Model, spec: PayloadSpec) -> CarriedPayload:
    """The payload of `spec` on `model`, whose inertias are left as they are.

    Raises
    ------
    ConfigError
        The link is unknown, no body has such an inertia, or the capsule is larger than the robot.
    """
    frames = {str(frame.name): frame for frame in model.frames if frame.type == pin.FrameType.BODY}
    if spec.link not in frames:
        raise ConfigError(
            f"robot.payload.link: the robot has no link '{spec.link}'."
            f"{nearest(spec.link, frames)} Its links: {', '.join(sorted(frames))}."
        )
    _check_inertia(spec)
    frame = frames[spec.link]
    joint, placement = int(frame.parentJoint), frame.placement
    inertia = pin.Inertia(spec.mass, np.array(spec.center), np.diag(spec.inertia))
    # A URDF may have a link of this name too; labels and `ignore` must not mix them up.
    name = PAYLOAD if PAYLOAD not in frames else f"robot.{PAYLOAD}"
    capsule = Capsule(
        name=name,
        joint=joint,
        start=np.array(placement.act(np.array(spec.start))),
        end=np.array(placement.act(np.array(spec.end))),
        radius=spec.radius,
        links=(name,),
        by_hand=True,
    )
    check_size(model, capsule, "robot.payload")
    return CarriedPayload(
        spec.link, capsule, np.array(placement.act(inertia).toDynamicParameters())
    )


def add_payload(model: pin.Model, payload: CarriedPayload) -> None:
    """Let the body that carries `payload` have its inertia too."""
    if payload.phi[0] > 0:
        joint = payload.capsule.joint
        added = pin.Inertia.FromDynamicParameters(payload.phi)
        model.inertias[joint] = model.inertias[joint] + added


def _check_inertia(spec: PayloadSpec) -> None:
    moments = sorted(spec.inertia)
    if spec.mass == 0 and moments[-1] > 0:
        raise ConfigError("robot.payload: it has an inertia but no mass; give robot.payload.mass.")
    if moments[2] > (moments[0] + moments[1]) * (1 + _ROUNDING):
        raise ConfigError(
            f"robot.payload.inertia: no body has the moments "
            f"{', '.join(f'{moment:g}' for moment in spec.inertia)} about its centre of mass; each "
            "is at most the sum of the other two."
        )
