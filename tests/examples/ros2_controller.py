"""A controller of ROS 2 as the network sees it: a FollowJointTrajectory server and /joint_states.

A node of real ROS 2, for where that is installed (test_measure_ros2.py). It answers as
`joint_trajectory_controller` does: its joints have an order of their own, it holds where it is when
a goal is cancelled, and gives up beyond the path tolerance. It plays in real time.

    python -m tests.examples.ros2_controller URDF JOINT,JOINT,… START,START,… [jam=SECONDS]
"""

import sys
import threading
import time

import numpy as np
import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from sensor_msgs.msg import JointState

from tests.examples.tracking_arm import TrackingArm

RATE = 100.0  # Hz
ACTION = "/joint_trajectory_controller/follow_joint_trajectory"


def main() -> None:
    urdf, joints, start, *more = sys.argv[1:]
    faults = dict(x.split("=") for x in more)
    jam = float(faults.get("jam", "inf"))
    arm = TrackingArm(urdf, joints.split(","), 1 / RATE)
    arm.place([float(x) for x in start.split(",")])
    rclpy.init()
    node = rclpy.create_node("controller")
    states = node.create_publisher(JointState, "/joint_states", 10)
    lock = threading.Lock()
    order = list(reversed(arm.joints))
    playing = {"goal": None}

    def tick() -> None:
        with lock:
            goal = playing["goal"]
            target = arm.target
            if goal is not None:
                now = time.monotonic() - goal["begin"]
                if now < jam:
                    target = np.array([np.interp(now, goal["t"], c) for c in goal["q"].T])
                goal["off"] = max(goal["off"], 0.0 if now < jam else 9.9)
            arm.step(target)
            tau = arm.torque()
        message = JointState()
        message.header.stamp = node.get_clock().now().to_msg()
        message.name = order
        message.position, message.velocity = arm.q[::-1].tolist(), arm.v[::-1].tolist()
        message.effort = [] if "mute" in faults else tau[::-1].tolist()
        states.publish(message)

    def play(handle):
        trajectory = handle.request.trajectory
        at = [trajectory.joint_names.index(j) for j in arm.joints]
        t = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in trajectory.points]
        q = np.array([p.positions for p in trajectory.points])[:, at]
        goal = {
            "t": [0.0, *t],
            "q": np.vstack([arm.target, q]),
            "begin": time.monotonic(),
            "off": 0.0,
        }
        with lock:
            playing["goal"] = goal
        result = FollowJointTrajectory.Result()
        while time.monotonic() - goal["begin"] < t[-1]:
            time.sleep(0.005)
            if handle.is_cancel_requested:
                with lock:
                    playing["goal"] = None
                handle.canceled()
                print("cancelled", flush=True)
                return result
            if goal["off"] > handle.request.path_tolerance[0].position:
                with lock:
                    playing["goal"] = None
                handle.abort()
                result.error_code = FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
                result.error_string = "jammed"
                return result
        with lock:
            playing["goal"] = None
        handle.succeed()
        print("played", flush=True)
        return result

    group = ReentrantCallbackGroup()
    node.create_timer(1 / RATE, tick, callback_group=group)
    ActionServer(
        node,
        FollowJointTrajectory,
        ACTION,
        play,
        callback_group=group,
        goal_callback=lambda goal: (
            GoalResponse.ACCEPT
            if set(goal.trajectory.joint_names) == set(arm.joints)
            else GoalResponse.REJECT
        ),
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    print("ready", flush=True)
    executor.spin()


if __name__ == "__main__":
    main()
