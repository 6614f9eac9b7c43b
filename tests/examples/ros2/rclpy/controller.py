"""A trajectory controller and its arm, on a clock of their own."""

import json
import os
import time
from array import array
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from control_msgs.action import FollowJointTrajectory
from rclpy.duration import Stamp
from rclpy.task import Future
from sensor_msgs.msg import Header, JointState

from tests.examples.tracking_arm import TrackingArm

PERIOD = 0.01  # s
EPOCH = 1_700_000_000.0  # s


class Controller:
    """Its joints are in an order of their own; what happened is written to the file `saw`."""

    def __init__(
        self,
        urdf: str,
        joints: list[str],
        start: list[float],
        saw: str,
        jam: float = np.inf,
        slow: float = 1.0,
        effort: bool = True,
        pause: float = 0.0,
        silent: float = np.inf,
    ) -> None:
        self.arm = TrackingArm(Path(urdf), joints, PERIOD)
        self.arm.place(np.array(start))
        self.saw, self.jam, self.slow, self.effort = Path(saw), jam, slow, effort
        self.pause, self.silent = pause, silent
        self.hearers: list = []
        self.time, self.begun, self.goal, self.result = 0.0, 0.0, None, Future()

    @classmethod
    def told(cls) -> "Controller":
        return cls(**json.loads(os.environ["STAND_IN"]))

    def _see(self, what: str) -> None:
        with self.saw.open("a") as file:
            file.write(what + "\n")

    def accept(self, goal) -> bool:
        if set(goal.trajectory.joint_names) != set(self.arm.joints):
            return False
        self.goal, self.begun, self.result = goal, self.time, Future()
        points = goal.trajectory.points
        at = [goal.trajectory.joint_names.index(joint) for joint in self.arm.joints]
        times = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in points]
        self.t = np.array([-1e-9, *times])
        self.q = np.vstack([self.arm.target, np.array([p.positions for p in points])[:, at]])
        self._see(f"accepted {len(points)} for {times[-1]:.1f} s")
        return True

    def cancel(self) -> Future:
        self.goal = None
        self._see(f"cancelled {np.abs(self.arm.v).max() > 0}")
        return Future(SimpleNamespace(), done=True)

    def period(self) -> bool:
        """Let a period pass; whether joint states were published."""
        time.sleep(self.pause)
        self.time += PERIOD
        now = self.slow * (self.time - self.begun)
        if self.goal is None:
            self.arm.step(self.arm.target)
        else:
            jammed = now > self.jam and (len(self.q) > 2 or self.jam < 0.0)
            target = np.array([np.interp(now, self.t, column) for column in self.q.T])
            self.arm.step(self.arm.target if jammed else target)
            if np.abs(target - self.arm.q).max() > self.goal.path_tolerance[0].position:
                self._end(FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED, "path tolerance")
            elif now > self.t[-1]:
                self._end(FollowJointTrajectory.Result.SUCCESSFUL, "")
        if now > self.silent and self.goal is not None:
            return False
        self._publish()
        return True

    def _end(self, code: int, why: str) -> None:
        result = FollowJointTrajectory.Result(error_code=code, error_string=why)
        self.goal = None
        self.result.set_result(SimpleNamespace(status=4 if code == 0 else 6, result=result))
        self._see(f"ended {code}")

    def _publish(self) -> None:
        stamp = Stamp(*divmod(round((EPOCH + self.time) * 1e9), 10**9))
        gripper = JointState(header=Header(stamp=stamp), name=["finger"], position=array("d", [0]))
        arm = JointState(
            header=Header(stamp=stamp),
            name=[*reversed(self.arm.joints)],
            position=array("d", self.arm.q[::-1]),
            velocity=array("d", self.arm.v[::-1]),
            effort=array("d", self.arm.torque()[::-1] if self.effort else []),
        )
        for hear in self.hearers:
            hear(gripper)
            hear(arm)
