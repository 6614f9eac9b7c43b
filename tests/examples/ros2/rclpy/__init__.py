"""Stands in for rclpy where ROS 2 is not installed: what `examples/measure_ros2.py` asks of it.

Names, arguments and message fields are those of rclpy and of the interfaces' definitions. The
controller is in this process and runs on a clock of its own: each `spin_once` is a period. What
it is told in the environment: STAND_IN, JSON of `controller.Controller`'s arguments.
"""

import time

from rclpy.signals import SignalHandlerOptions

_playing: list = []


def playing():
    """The controller of this process."""
    return _playing[0]


def init(*, signal_handler_options: SignalHandlerOptions = SignalHandlerOptions.ALL) -> None:
    # With its own handlers, rclpy shuts down on a signal, and nothing can be cancelled any more.
    assert signal_handler_options is SignalHandlerOptions.NO
    from rclpy.controller import Controller  # Pinocchio is slow to import

    _playing.append(Controller.told())


class Node:
    def create_subscription(self, kind, topic, callback, qos_profile) -> None:
        if topic == "/joint_states":
            playing().hearers.append(callback)


def create_node(node_name: str) -> Node:
    return Node()


def spin_once(node: Node, *, timeout_sec: float | None = None) -> None:
    if not playing().period():
        time.sleep(timeout_sec or 0.0)


def spin_until_future_complete(node: Node, future, timeout_sec: float | None = None) -> None:
    for _ in range(int(100 * (timeout_sec or 1.0))):
        if future.done():
            return
        spin_once(node, timeout_sec=0.01)
