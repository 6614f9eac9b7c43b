"""Wrenches and motion of a base as six more joints of the data.

With forces f_i that are measured where the robot touches its surroundings, the equations of motion
are

    [0; τ] + Σ J_iᵀ f_i = Y φ,

of the six rows of the base and those of the joints (Ayusawa, Venture, Nakamura 2014). The left side
is what the data hold as torque: the first six need no torque of a joint.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from excite_cli.base_link.state import base_state
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.wrench_spec import WrenchSpec
from excite_cli.dynamics.contact_frames import ContactFrame, contact_jacobians
from excite_cli.measurement.base_channel import of_wrench
from excite_cli.measurement.dataset import Array, Dataset, Finding, Run
from excite_cli.measurement.wrench_channels import channel_of
from excite_cli.robot.base_joints import BASE_JOINTS
from excite_cli.robot.link_frame import link_frame
from excite_cli.robot.model import Robot

_REFERENCE = "q_ref"
_LEANS = np.radians(1.0)  # a mounting is hardly better


def frames_of(robot: Robot, specs: Sequence[WrenchSpec]) -> tuple[ContactFrame, ...]:
    """Frames of the declared sensors on `robot`, that of the data.

    Raises
    ------
    ConfigError
        A link is unknown.
    """
    return tuple(_frame(robot, spec) for spec in specs)


def _frame(robot: Robot, spec: WrenchSpec) -> ContactFrame:
    joint, rotation, position = len(BASE_JOINTS) - 1, np.eye(3), np.zeros(3)
    if spec.link is not None:
        frame = link_frame(robot, spec.link, "measurement.wrench.link")
        joint, rotation, position = frame.joint, frame.rotation, frame.translation
    own, at = Rotation.from_euler("xyz", spec.rotation).as_matrix(), np.array(spec.position)
    in_world = spec.frame == "world"
    if not in_world:
        own, at = rotation @ own, rotation @ at + position
    return ContactFrame(joint, own, at, in_world)


def sign_of(spec: WrenchSpec) -> float:
    """What makes the recorded wrench one that acts on the robot."""
    return 1.0 if spec.acts_on == "robot" else -1.0


def with_base(
    robot: Robot, data: Dataset, spec: MeasurementSpec, torques: bool
) -> tuple[Dataset, tuple[Finding, ...]]:
    """The data with the six joints of the base first, and what was noticed of it.

    `robot` is that of the data (`build_measured_robot`); without `torques`, those of joints count
    as not measured.

    Raises
    ------
    FileError
        A wrench, or what is declared of the base's motion, is not in the data.
    ConfigError
        A link is unknown.
    """
    frames, count = frames_of(robot, spec.wrench), len(BASE_JOINTS)
    runs: list[Run] = []
    findings: list[Finding] = []
    for run in data.runs:
        state = base_state(robot, run, spec.base)
        wrenches = [sign_of(each) * channel_of(run, of_wrench(each)) for each in spec.wrench]
        q = np.hstack([state.q, run.q])
        tau = np.hstack([np.zeros((len(run.t), count)), run.tau])
        for t, parts in enumerate(contact_jacobians(robot, frames, q)):
            for jacobian, wrench in zip(parts, wrenches, strict=True):
                tau[t] += jacobian.T @ wrench[t]
        known = run.usable() if torques else np.zeros(run.tau.shape, bool)
        valid = np.hstack([np.ones((len(run.t), count), bool), known])
        dq = run.dq
        if dq is not None:
            dq = np.hstack([np.gradient(state.q, run.step, axis=0), dq])
        step, extra = run.torque_step, dict(run.extra)
        if extra.get(_REFERENCE, q).shape == run.q.shape:  # of a base that should stand still
            extra[_REFERENCE] = np.hstack([np.zeros((len(run.t), count)), extra[_REFERENCE]])
        runs.append(
            replace(
                run, q=q, tau=tau, dq=dq, valid=valid, base_rows=count, extra=extra,
                torque_step=None if step is None else np.concatenate([np.zeros(count), step]),
            )
        )  # fmt: skip
        if state.lean is not None and np.linalg.norm(state.lean) > _LEANS:
            findings.append(_leaning(state.lean, run))
    names = (*BASE_JOINTS, *data.joint_names)
    return replace(data, joint_names=names, runs=tuple(runs)), tuple(findings)


def _leaning(lean: Array, run: Run) -> Finding:
    angle = np.degrees(np.linalg.norm(lean))
    axes = ", ".join(f"{np.degrees(x):+.1f}°" for x in lean)
    text = (
        f"the inertial unit says that the base leans by {angle:.1f}° from robot.base_orientation "
        f"(about its x, y, z: {axes}): the floor is tilted, or the unit's mounting is. The "
        "effect of gravity on the wrench decides which: `excite diagnose` looks for base_tilt"
    )
    return Finding("leaning", "warning", text, run.name)
