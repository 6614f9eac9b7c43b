"""Play a motion with a ROS 2 controller and record it, for `excite campaign --measure`.

    excite campaign arm.yaml --measure 'python measure_ros2.py {motion} {data}'

Needs a sourced ROS 2 with control_msgs, and a `joint_trajectory_controller` or another server of
FollowJointTrajectory. The log has a row per message of /joint_states, with its time stamp: q, dq
and effort, as the driver gives them. Any doubt cancels the motion; the reason is on stderr.
"""

import argparse
import csv
import signal
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

REST = 0.5  # s recorded before and after the motion
DISCOVERY = 3.0  # s until who publishes joint states is known
SILENCE = 0.5  # s without a message after which the connection counts as lost
LATE = np.linspace(-0.2, 0.2, 9)  # s by which the controller may have begun earlier or later


class Doubt(Exception):
    """Why there is no measurement."""


class Robot:
    """Its joint states, as rows of time stamp, q, dq, effort (1 + 3n), and its controller."""

    def __init__(self, joints: list[str], states: str, action: str) -> None:
        rclpy.init(
            signal_handler_options=SignalHandlerOptions.NO
        )  # else no goal could be cancelled
        self.node, self.joints = rclpy.create_node("excite_measure"), joints
        self.rows: list[list[float]] = []
        self.names: set[str] = set()
        self.node.create_subscription(JointState, states, self._hear, 1000)
        self.client = ActionClient(self.node, FollowJointTrajectory, action)
        if not self.client.wait_for_server(timeout_sec=5.0):
            raise Doubt(f"there is no action server {action}")
        self.heard = time.monotonic() + DISCOVERY - SILENCE

    def _hear(self, state: JointState) -> None:
        self.names.update(state.name)
        if not set(self.joints) <= set(state.name):
            return  # a gripper, say, that publishes its own
        at = [state.name.index(joint) for joint in self.joints]
        row = [state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec]
        for channel in (state.position, state.velocity, state.effort):
            row += [channel[i] if i < len(channel) else np.nan for i in at]
        self.rows.append(row)
        self.heard = time.monotonic()

    def listen(self) -> list[float]:
        """Wait for the next row."""
        count = len(self.rows)
        while len(self.rows) == count:
            if time.monotonic() - self.heard > SILENCE:
                missing = set(self.joints) - self.names
                raise Doubt(f"no joint states of {', '.join(sorted(missing or self.joints))}")
            rclpy.spin_once(self.node, timeout_sec=0.1)
        if not np.isfinite(self.rows[-1]).all():
            raise Doubt("joint states lack positions, velocities or efforts")
        return self.rows[-1]

    def off(self, start: np.ndarray) -> float:
        """How far the joint is that is farthest from `start` (n) [rad, m]."""
        return float(np.abs(np.array(self.listen()[1 : len(start) + 1]) - start).max())

    def rest(self) -> None:
        """Record for a while."""
        end = self.listen()[0] + REST
        while self.listen()[0] < end:
            pass

    def follow(self, t: np.ndarray, states: np.ndarray, tolerance: float) -> None:
        """Play positions, speeds, accelerations (T, 3, n) at `t` (T), and wait for the end."""
        goal, hold = FollowJointTrajectory.Goal(), Duration(seconds=1.0).to_msg()
        goal.trajectory.joint_names = self.joints
        for instant, (q, v, a) in zip(t.tolist(), states.tolist(), strict=True):
            point = JointTrajectoryPoint(positions=q, velocities=v, accelerations=a)
            point.time_from_start = Duration(seconds=instant).to_msg()
            goal.trajectory.points.append(point)
        goal.path_tolerance = [JointTolerance(name=j, position=tolerance) for j in self.joints]
        goal.goal_tolerance, goal.goal_time_tolerance = goal.path_tolerance, hold
        sent = self.client.send_goal_async(goal)
        try:
            while not sent.done():
                self.listen()
            if not sent.result().accepted:
                raise Doubt("the controller refused the motion")
            result, begin = sent.result().get_result_async(), self.rows[-1][0]
            while not result.done():
                now, *state = self.listen()
                q, when = np.array(state[: len(self.joints)]), now - begin + LATE
                planned = np.array([np.interp(when, t, column) for column in states[:, 0].T])
                off = np.maximum(planned.min(axis=1) - q, q - planned.max(axis=1))
                if off.max() > tolerance:
                    raise Doubt(f"{self.joints[off.argmax()]} is {off.max():.2f} off the motion")
        except Exception:
            ignore_signals()
            rclpy.spin_until_future_complete(self.node, sent, timeout_sec=2.0)
            if sent.done() and sent.result().accepted:
                cancelled = sent.result().cancel_goal_async()
                rclpy.spin_until_future_complete(self.node, cancelled, timeout_sec=2.0)
            raise
        if (answer := result.result().result).error_code != FollowJointTrajectory.Result.SUCCESSFUL:
            raise Doubt(f"the controller gave up ({answer.error_code}): {answer.error_string}")


def measure(options: argparse.Namespace) -> None:
    """Play `options.motion`, and write `options.data` when all of it was measured."""
    table = np.genfromtxt(options.motion, delimiter=",", names=True, deletechars="")
    joints = [name[2:] for name in table.dtype.names if name.startswith("q_")]
    states = np.array([[table[f"{c}_{j}"] for j in joints] for c in ("q", "dq", "ddq")])
    states = states.transpose(2, 0, 1)
    if not np.isfinite(states).all() or not (np.diff(table["t"]) > 0.0).all():
        raise Doubt(f"{options.motion} has gaps, or times that do not increase")
    if not np.abs(states[[0, -1], 1]).max() < 1e-3:
        raise Doubt("the motion does not begin and end at rest; `excite export --entry` makes it")
    robot = Robot(joints, options.states, options.action)
    if (off := robot.off(states[0, 0])) > options.reach:
        raise Doubt(f"the robot is {off:.2f} off the start; bring it there, or raise --reach")
    if off > 2e-3:  # slowly, and from nearby only: the way there was checked by nobody
        still = np.stack([states[0, 0], 0 * states[0, 0], 0 * states[0, 0]])[None]
        robot.follow(np.array([1.0 + off / 0.1]), still, options.reach + options.tolerance)
        robot.rest()
        if (off := robot.off(states[0, 0])) > 0.01:
            raise Doubt(f"the robot does not get to the start, {off:.2f} are left")
    robot.rows.clear()
    robot.rest()
    robot.follow(table["t"] - table["t"][0], states, options.tolerance)
    robot.rest()
    partial = options.data.with_name(options.data.name + ".part")
    with partial.open("w", newline="") as file:
        names = [f"{channel}_{joint}" for channel in ("q", "dq", "tau") for joint in joints]
        csv.writer(file).writerows([["t", *names], *robot.rows])
    partial.replace(options.data)


def ignore_signals() -> None:
    """From here on the robot is being stopped, which a second signal must not prevent."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: None)


def ended(number: int, _: object) -> None:
    """Turn a signal (time limit, Ctrl-C) into a doubt."""
    ignore_signals()
    raise Doubt(f"stopped by {signal.Signals(number).name}")


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = "/joint_trajectory_controller/follow_joint_trajectory"
    parser.add_argument("--action", default=default)
    parser.add_argument("--states", default="/joint_states", help="topic")
    parser.add_argument("--reach", type=float, default=0.1, help="to go to the start by itself")
    parser.add_argument("--tolerance", type=float, default=0.2, help="rad or m off the motion")
    parser.add_argument("motion", type=Path, help="CSV of `excite export --entry`")
    parser.add_argument("data", type=Path, help="CSV to write")
    options = parser.parse_args()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, ended)
    try:
        measure(options)
    except Exception as error:
        print(f"not measured: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
