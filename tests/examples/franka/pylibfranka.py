"""A stand-in of pylibfranka 0.21: what `measure_franka.py` uses of it, and an arm that follows.

`STAND_IN` in the environment is JSON: urdf, joints, start, and faults: `refuse` (no connection),
`mode` and `errors` at first, `reflex`, `jam` and `lost` (network) at an instant [s]; `saw` is where
it writes how a control ended. Time is the robot's own: nothing waits. As the robot does, it takes
no set points whose acceleration jumps, and none that begin elsewhere than at `q_d`.
"""

import json
import os
import time
from enum import Enum
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from tests.examples.tracking_arm import TrackingArm

GIVEN = json.loads(os.environ.get("STAND_IN", "{}"))
PERIOD, JERK = 1e-3, 3750.0  # s; rad/s³, the least of a Panda's joints


class RobotMode(Enum):
    Idle, Move, Reflex = 1, 2, 4


class RealtimeConfig(Enum):
    kEnforce, kIgnore = 0, 1


class ControllerMode(Enum):
    JointImpedance, CartesianImpedance = 0, 1


class Errors(str):
    """Names of what is wrong; false where nothing is."""


class Duration(float):
    def to_sec(self) -> float:
        return float(self)


class JointPositions:
    def __init__(self, q: list[float]) -> None:
        assert len(q) == 7
        self.q, self.motion_finished = q, False


class ActiveControlBase:
    def __init__(self, arm: TrackingArm) -> None:
        self.arm, self.sent, self.first, self.now = arm, [arm.q] * 3, True, 0.0

    def readOnce(self) -> tuple[SimpleNamespace, Duration]:
        if self.now > GIVEN.get("reflex", np.inf):
            raise RuntimeError("libfranka: Move command aborted: motion aborted by reflex!")
        if self.now > GIVEN.get("lost", np.inf):
            raise RuntimeError("libfranka: UDP receive: Timeout")
        passed = Duration(0.0 if self.first else PERIOD)
        self.first, self.now = False, self.now + passed
        time.sleep(GIVEN.get("pause", 0.0))
        return state_of(self.arm, 50.0 + self.now), passed

    def writeOnce(self, command: JointPositions) -> None:
        self.sent = [*self.sent[-3:], np.array(command.q)]
        jerk = np.abs(np.diff(self.sent, n=3, axis=0)).max() / PERIOD**3 if self.now else 0.0
        if jerk > JERK or np.abs(self.sent[-1] - self.sent[-2]).max() > 0.01:
            raise RuntimeError("joint_motion_generator_acceleration_discontinuity")
        self.arm.step(self.arm.q if self.now > GIVEN.get("jam", np.inf) else self.sent[-1])
        if command.motion_finished:
            Path(GIVEN["saw"]).write_text("finished")


class Robot:
    def __init__(self, robot_ip_address: str, realtime_config: RealtimeConfig) -> None:
        if GIVEN.get("refuse"):
            raise RuntimeError("libfranka: Connection to FCI refused.")
        self.arm = TrackingArm(GIVEN["urdf"], GIVEN["joints"], PERIOD)
        self.arm.place(GIVEN["start"])

    def read_once(self) -> SimpleNamespace:
        return state_of(self.arm, 50.0)

    def start_joint_position_control(self, arg0: ControllerMode) -> ActiveControlBase:
        Path(GIVEN["saw"]).write_text("began")
        return ActiveControlBase(self.arm)

    def stop(self) -> None:
        Path(GIVEN["saw"]).write_text("stopped")
        if "lost" in GIVEN:
            raise RuntimeError("libfranka: TCP send: Connection reset")


def state_of(arm: TrackingArm, now: float) -> SimpleNamespace:
    """A `RobotState`."""
    tau = arm.torque()
    mode, errors = RobotMode[GIVEN.get("mode", "Idle")], Errors(GIVEN.get("errors", ""))
    return SimpleNamespace(time=Duration(now), q=arm.q, dq=arm.v, tau_J=tau, tau_J_d=0 * tau,
                           q_d=arm.target, robot_mode=mode, current_errors=errors)  # fmt: skip
