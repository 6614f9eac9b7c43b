"""Play a motion on a robot of Franka Robotics and record it, for `excite campaign --measure`.

    excite campaign arm.yaml --measure 'python measure_franka.py --host 172.16.0.2 {motion} {data}'

Needs `pip install pylibfranka scipy`, and a real-time kernel (or `--no-realtime`). The log has a
row per packet of the robot, with its time stamp: q, dq [rad, rad/s], tau_J [N·m], as measured at
the link side, and desired [N·m], which its controller asks for, without gravity. Any doubt stops
the robot; the reason is on stderr, the status 1.
"""

import argparse
import csv
import gc
import signal
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
from pylibfranka import ControllerMode, JointPositions, RealtimeConfig, Robot, RobotMode
from scipy.interpolate import BPoly

CHANNELS = {"q": "q", "dq": "dq", "tau_J": "tau_J", "desired": "tau_J_d"}
REST = 0.5  # s recorded before and after the motion
PERIOD = 1e-3  # s from set point to set point


class Doubt(Exception):
    """Why there is no measurement."""


def read_motion(path: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Joints, instants (T) from 0, and positions, speeds, accelerations (T, 3, 7), rest to rest."""
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="")
    joints = [name[2:] for name in table.dtype.names if name.startswith("q_")]
    if [joint[-1] for joint in joints] != list("1234567"):
        raise Doubt(
            f"the motion's joints are {', '.join(joints)}; the robot has 7, in the order of their "
            "numbers: robot.joints of the config sets them"
        )
    states = np.array([[table[f"{c}_{j}"] for j in joints] for c in ("q", "dq", "ddq")])
    states = states.transpose(2, 0, 1)
    if not np.isfinite(states).all() or not (np.diff(table["t"]) > 0.0).all():
        raise Doubt(f"{path} has gaps, or times that do not increase")
    if not np.abs(states[[0, -1], 1]).max() < 1e-3:
        raise Doubt("the motion does not begin and end at rest; `excite export --entry` makes it")
    return joints, table["t"] - table["t"][0], states


def planned(
    t: np.ndarray, states: np.ndarray, commanded: np.ndarray, off: float
) -> tuple[float, np.ndarray]:
    """When the robot stands at the start, `off` rad away, and its set points (K, 7) until the end.

    The way there is slow, 0.1 rad/s at most. Accelerations do not jump, as the robot demands.
    """
    arrived = 1.0 + off / 0.05
    still = np.zeros_like(states[:1])
    states = np.concatenate([still, still, states, still])
    states[0, 0], states[1, 0], states[-1, 0] = commanded, states[2, 0], states[-2, 0]
    start = arrived + REST
    instants = np.concatenate([[0.0, arrived], start + t, [start + t[-1] + REST]])
    path = BPoly.from_derivatives(instants, states)
    return arrived, path(np.arange(0.0, instants[-1], PERIOD))


def play(robot: Robot, joints, t, states, options: argparse.Namespace) -> list[np.ndarray]:
    """Play the motion by the robot's clock; a row per packet from before its start to its end."""
    state = robot.read_once()
    if state.robot_mode != RobotMode.Idle or state.current_errors:
        errors = f" ({state.current_errors})" if state.current_errors else ""
        raise Doubt(f"the robot is in mode {state.robot_mode.name}{errors}; Desk makes it Idle")
    off = np.abs(state.q - states[0, 0]).max()
    if off > options.reach:
        raise Doubt(f"the robot is {off:.2f} rad off the start; bring it there, or raise --reach")
    arrived, path = planned(t, states, np.asarray(state.q_d), off)
    rows: list[np.ndarray] = []
    elapsed, last = 0.0, len(path) - 1
    gc.disable()  # it may take longer than a set point lasts
    try:
        control = robot.start_joint_position_control(ControllerMode.JointImpedance)
        while True:
            state, passed = control.readOnce()
            elapsed += passed.to_sec()
            k = min(round(elapsed / PERIOD), last)
            if elapsed >= arrived:
                channels = [getattr(state, name) for name in CHANNELS.values()]
                rows.append(np.concatenate([[state.time.to_sec()], *channels]))
            far = np.abs(state.q - path[k])
            if far.max() > options.tolerance:
                raise Doubt(f"{joints[far.argmax()]} is {far.max():.2f} rad off the motion")
            command = JointPositions(path[k].tolist())
            command.motion_finished = k == last
            control.writeOnce(command)
            if command.motion_finished:
                return rows
    except Exception:
        ignore_signals()
        with suppress(Exception):  # where it is out of reach, it stops by itself
            robot.stop()
        raise


def measure(options: argparse.Namespace) -> None:
    """Play `options.motion`, and write `options.data` when all of it was measured."""
    joints, t, states = read_motion(options.motion)
    rows = play(Robot(options.host, options.realtime), joints, t, states, options)
    partial = options.data.with_name(options.data.name + ".part")
    with partial.open("w", newline="") as file:
        names = [f"{channel}_{joint}" for channel in CHANNELS for joint in joints]
        csv.writer(file).writerows([["t", *names], *(row.tolist() for row in rows)])
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
    parser.add_argument("--host", required=True, help="address of the robot")
    parser.add_argument("--reach", type=float, default=0.1, help="rad to go to the start by itself")
    parser.add_argument("--tolerance", type=float, default=0.2, help="rad off the motion")
    parser.add_argument("--no-realtime", dest="realtime", action="store_const",
                        const=RealtimeConfig.kIgnore, default=RealtimeConfig.kEnforce,
                        help="without a real-time kernel; may lose packets")  # fmt: skip
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
