from types import SimpleNamespace

import rclpy
from rclpy.task import Future


class ActionClient:
    def __init__(self, node, action_type, action_name: str) -> None:
        self.name = action_name

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        return self.name == "/joint_trajectory_controller/follow_joint_trajectory"

    def send_goal_async(self, goal) -> Future:
        accepted = rclpy.playing().accept(goal)
        return Future(
            SimpleNamespace(
                accepted=accepted,
                get_result_async=lambda: rclpy.playing().result,
                cancel_goal_async=rclpy.playing().cancel,
            ),
            done=True,
        )
