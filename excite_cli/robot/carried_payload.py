"""A rigid payload: its inertia on the body that carries it, and its capsule; a robot's reach."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array
from excite_cli.config.robot_spec import PayloadSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.capsule import Capsule

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


# How far a robot reaches: what no capsule given by hand can sensibly exceed.

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
