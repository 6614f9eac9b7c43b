"""Play a motion on a robot of Universal Robots and record it, for `excite campaign --measure`.

    excite campaign arm.yaml --measure 'python measure_ur.py --host 192.168.0.2 {motion} {data}'

Needs `pip install ur_rtde`. The log has a row per packet of the controller, with its time stamps:
q, dq [rad, rad/s], current [A], temp [°C] of each joint, as measured, and moment [N·m], which the
controller's own model expects. Any doubt stops the robot; the reason is on stderr, the status 1.
"""

import argparse
import csv
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Never

import numpy as np
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

ORDER = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
CHANNELS = {
    "q": "actual_q",
    "dq": "actual_qd",
    "current": "actual_current",
    "temp": "joint_temperatures",
    "moment": "target_moment",
}
STATE = ["robot_mode", "safety_mode", "safety_status_bits", "runtime_state"]
SPEED = ["speed_scaling", "target_speed_fraction"]
RUNNING, NORMAL = 7, 1  # robot_mode and safety_mode in which a motion is played as planned
REST = 0.5  # s recorded before and after the motion
SILENCE = 0.2  # s without a packet after which the connection counts as lost
LOOKAHEAD, GAIN = 0.1, 300  # of servoj, as Universal Robots sets them


class Doubt(Exception):
    """Why there is no measurement."""


def read_motion(path: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Joints, instants (T) from 0, and positions (T, 6), from rest to rest."""
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="")
    joints = [name[2:] for name in table.dtype.names if name.startswith("q_")]
    q, v = (np.column_stack([table[f"{c}_{joint}"] for joint in joints]) for c in ("q", "dq"))
    if len(joints) != 6 or not all(map(str.__contains__, joints, ORDER)):
        raise Doubt(f"the motion's joints are {', '.join(joints)}, the robot's {', '.join(ORDER)}")
    if not np.isfinite(q).all() or not (np.diff(table["t"]) > 0.0).all():
        raise Doubt(f"{path} has gaps, or times that do not increase")
    if not np.abs(v[[0, -1]]).max() < 1e-3:
        raise Doubt("the motion does not begin and end at rest; `excite export --entry` makes it")
    return joints, table["t"] - table["t"][0], q


def packets(receive: RTDEReceiveInterface) -> Iterator[np.ndarray]:
    """A row per packet: time stamp and `CHANNELS` (1 + 30), while nothing is in doubt."""
    last, heard = receive.getTimestamp(), time.monotonic()
    while True:
        row = np.array(
            [
                receive.getTimestamp(),
                *receive.getActualQ(),
                *receive.getActualQd(),
                *receive.getActualCurrent(),
                *receive.getJointTemperatures(),
                *receive.getTargetMoment(),
            ]
        )
        if time.monotonic() - heard > SILENCE or not receive.isConnected():
            raise Doubt("the connection is lost")
        if row[0] == last or receive.getTimestamp() != row[0]:
            time.sleep(2e-4)
            continue
        if receive.isEmergencyStopped() or receive.isProtectiveStopped():
            raise Doubt("the robot is in a protective or emergency stop")
        if (receive.getRobotMode(), receive.getSafetyMode()) != (RUNNING, NORMAL):
            raise Doubt("the robot is not running in normal mode (off, brakes, reduced, recovery)")
        if receive.getSpeedScaling() * receive.getTargetSpeedFraction() < 0.99:
            raise Doubt(
                "speed is scaled down; set the slider to 100 %, and slow the motion instead"
            )
        last, heard = row[0], time.monotonic()
        yield row


def approach(control: RTDEControlInterface, receive: RTDEReceiveInterface, start, reach) -> None:
    """Go to the start at 0.1 rad/s, from nearby only: the way there was checked by nobody."""
    for count, row in enumerate(packets(receive)):
        off, speed = np.abs(row[1:7] - start).max(), np.abs(row[7:13]).max()
        if off < 2e-3 and speed < 0.01:
            return
        if count == 0:
            if off > reach:
                raise Doubt(f"the robot is {off:.2f} rad off the start; bring it there (--reach)")
            begun = row[0]
            control.moveJ(list(start), 0.1, 0.2, True)
        if row[0] - begun > 5.0 + 20.0 * reach:
            raise Doubt("the robot does not get to the start")


def play(control, receive, t: np.ndarray, q: np.ndarray, options) -> list[np.ndarray]:
    """Play the motion by the controller's clock; every packet from before its start to its end."""
    for instant in np.arange(0.0, t[-1], 0.2):
        if not control.isJointsWithinSafetyLimits(at(instant, t, q)):
            raise Doubt(f"at {instant:.1f} s the motion leaves the robot's safety limits")
    approach(control, receive, q[0], options.reach)
    control.setWatchdog(10.0)  # should this process die, the controller stops
    rows: list[np.ndarray] = []
    for row in packets(receive):
        if rows and row[0] - rows[-1][0] > SILENCE / 2:
            raise Doubt("packets are missing: this computer or the network is too slow")
        rows.append(row)
        now = row[0] - rows[0][0] - REST
        if now > t[-1] + REST:
            control.servoStop()
            control.stopScript()
            break
        off = np.abs(row[1:7] - at(now - LOOKAHEAD, t, q))
        if off.max() > options.tolerance:
            raise Doubt(f"{ORDER[off.argmax()]} is {off.max():.2f} rad off the motion")
        if not control.servoJ(at(now, t, q), 0.0, 0.0, 1.0 / options.rate, LOOKAHEAD, GAIN):
            raise Doubt("the controller takes no more set points")
    return rows


def at(instant: float, t: np.ndarray, q: np.ndarray) -> list[float]:
    """Positions at an instant; the first and last ones before and after the motion."""
    return [float(np.interp(instant, t, column)) for column in q.T]


def measure(options: argparse.Namespace) -> None:
    """Play `options.motion`, and write `options.data` when all of it was measured."""
    joints, t, q = read_motion(options.motion)
    variables = ["timestamp", *CHANNELS.values(), *STATE, *SPEED]
    receive = RTDEReceiveInterface(options.host, options.rate, variables)
    next(packets(receive))
    control = RTDEControlInterface(options.host, options.rate)
    try:
        rows = play(control, receive, t, q, options)
    except Exception as error:
        ignore_signals()
        # A robot that cannot be reached lets `ur_rtde` wait for minutes; its watchdog stops it.
        threading.Timer(3.0, give_up, (error,)).start()
        control.servoStop()
        control.stopScript()
        give_up(error)
    partial = options.data.with_name(options.data.name + ".part")
    with partial.open("w", newline="") as file:
        names = [f"{channel}_{joint}" for channel in CHANNELS for joint in joints]
        csv.writer(file).writerows([["t", *names], *(row.tolist() for row in rows)])
    partial.replace(options.data)


def give_up(error: Exception) -> Never:
    """Say why there is no measurement, and end at once."""
    print(f"\nnot measured: {error}", file=sys.stderr, flush=True)  # amid words of `ur_rtde`
    os._exit(1)


def ignore_signals() -> None:
    """From here on the robot is being stopped, which a second signal must not prevent."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: None)


def ended(number: int, _: object) -> None:
    """Turn a signal (time limit, Ctrl-C) into a doubt."""
    ignore_signals()
    raise Doubt(f"stopped by {signal.Signals(number).name}")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--host", required=True, help="address of the robot")
    parser.add_argument("--rate", type=float, default=500.0, help="Hz: 500, of a CB3 125")
    parser.add_argument("--reach", type=float, default=0.1, help="rad to go to the start by itself")
    parser.add_argument("--tolerance", type=float, default=0.2, help="rad off the motion")
    parser.add_argument("motion", type=Path, help="CSV of `excite export --entry`")
    parser.add_argument("data", type=Path, help="CSV to write")
    options = parser.parse_args()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, ended)
    try:
        measure(options)
    except Exception as error:
        give_up(error)


if __name__ == "__main__":
    main()
