"""A controller of Universal Robots as the network sees it: dashboard, script port and RTDE.

It speaks RTDE version 2 (Universal Robots, "Real-Time Data Exchange (RTDE) Guide") and does with
the registers what the script that `ur_rtde` uploads does, for the commands that are used here. It
is no simulator of the controller: URScript is not run. While it servos, its clock waits for the
next set point, 50 ms at most, so that a slow machine plays the same motion.
"""

import contextlib
import os
import socket
import struct
import threading
import time
from collections.abc import Iterator
from itertools import count

import numpy as np

from tests.examples.tracking_arm import TrackingArm

MOVEJ, SERVOJ, SERVO_STOP, SET_WATCHDOG, JOINTS_WITHIN, STOP_SCRIPT = 1, 11, 16, 35, 37, 255
READY, DONE = 1, 2
PLAYING, STOPPED = 2, 1
PROTECTIVE = 1 << 2  # of the safety status bits
TORQUE_PER_AMPERE = 10.0  # N·m of the joint
_TYPES = {
    **dict.fromkeys(("timestamp", "speed_scaling", "target_speed_fraction"), "DOUBLE"),
    **dict.fromkeys(("robot_mode", "safety_mode"), "INT32"),
    **dict.fromkeys(("robot_status_bits", "safety_status_bits", "runtime_state"), "UINT32"),
}
_PACKED = {"DOUBLE": "d", "INT32": "i", "UINT32": "I", "VECTOR6D": "6d"}
_addresses = count(1)


def _type(name: str) -> str:
    if "_register_" in name:
        return "DOUBLE" if "double" in name else "INT32"
    return _TYPES.get(name, "VECTOR6D")


class UrController:
    """Plays set points with `arm`; what it saw is in `moved`, `moved_to` and `ended`."""

    def __init__(self, arm: TrackingArm) -> None:
        self.arm = arm
        self.host = f"127.{os.getpid() % 200 + 20}.{os.getpid() // 200 % 250}.{next(_addresses)}"
        self.scaling = 1.0
        self.protective_stop_at, self.hang_up_at = np.inf, np.inf  # s after the first set point
        self.unplug_at, self.jam_at, self.unplugged = np.inf, np.inf, False
        self.limit = np.inf  # rad, of the safety planes
        self.ended, self.moved = "", 0.0  # by what; rad/s, the fastest joint so far
        self.moved_to: tuple[np.ndarray, float] | None = None  # of movej, at rad/s
        self.time, self.safety, self.servoing = 1000.0, 0, 0.0
        self.registers: dict[str, float] = {}
        self.running, self.executing, self.watched, self.fed = False, False, False, 0.0
        self.goal = self.arm.q.copy()
        self.lock, self.fresh, self.closed = threading.RLock(), threading.Event(), False
        self.unanswered: list[socket.socket] = []
        self.clients: list[tuple[socket.socket, list[str]]] = []
        serves = {29999: self._dashboard, 30003: self._script, 30004: self._exchange}
        self.servers = [socket.create_server((self.host, port)) for port in serves]
        for server, serve in zip(self.servers, serves.values(), strict=True):
            threading.Thread(target=self._accept, args=(server, serve), daemon=True).start()
        threading.Thread(target=self._run, daemon=True).start()

    def stand(self, q: np.ndarray) -> None:
        """Stand at `q` (6)."""
        with self.lock:
            self.arm.place(q)
            self.goal = self.arm.q.copy()

    def close(self) -> None:
        self.closed = True
        for server in self.servers:
            with contextlib.suppress(OSError):
                server.shutdown(socket.SHUT_RDWR)  # ends `accept`
            server.close()
        self._hang_up()

    def _accept(self, server: socket.socket, serve) -> None:
        while not self.closed:
            try:
                client, _ = server.accept()
            except OSError:
                return
            if self.unplugged:
                self.unanswered.append(client)
                continue
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=self._guarded, args=(serve, client), daemon=True).start()

    def _guarded(self, serve, client: socket.socket) -> None:
        try:
            serve(client)
        except (OSError, struct.error):
            client.close()

    def _dashboard(self, client: socket.socket) -> None:
        client.sendall(b"Connected: Universal Robots Dashboard Server\n")
        while client.recv(1024):
            client.sendall(b"URSoftware 3.15.8.106339 (Jun 07 2021)\n")

    def _script(self, client: socket.socket) -> None:
        while text := client.recv(1 << 16):
            if b"rtde_control" in text:
                with self.lock:
                    self.running, self.registers["output_int_register_0"] = True, READY

    def _exchange(self, client: socket.socket) -> None:
        inputs: list[list[str]] = []
        outputs: list[str] = []
        for kind, body in _packages(client):
            if kind == b"U":
                self._take(inputs[body[0] - 1], body[1:])
                continue
            answer = b"\x01"
            if kind == b"v":
                answer = struct.pack(">4I", 3, 15, 0, 0)
            elif kind in b"OI":
                names = body[8 if kind == b"O" else 0 :].decode().strip(",").split(",")
                if kind == b"O":
                    outputs = names
                else:
                    inputs.append(names)
                number = b"\x01" if kind == b"O" else bytes([len(inputs)])
                answer = number + ",".join(map(_type, names)).encode()
            client.sendall(struct.pack(">Hc", 3 + len(answer), kind) + answer)
            if kind == b"S":
                with self.lock:
                    self.clients.append((client, outputs))

    def _take(self, names: list[str], body: bytes) -> None:
        form = ">" + "".join(_PACKED[_type(name)] for name in names)
        with self.lock:
            if self.unplugged:
                return
            self.registers.update(zip(names, struct.unpack(form, body), strict=True))
            command = int(self.registers["input_int_register_0"])
            self.fed = time.monotonic()
        if command == SERVOJ:
            self.fresh.set()

    def _run(self) -> None:
        while not self.closed:
            if self.servoing:
                self.fresh.wait(0.05)
                self.fresh.clear()
            else:
                time.sleep(self.arm.period)
            with self.lock:
                self._tick()
                self.unplugged |= bool(self.servoing) and self.time - self.servoing > self.unplug_at
                if not self.unplugged:
                    self._tell()

    def _tick(self) -> None:
        self.time += self.arm.period
        if self.running and not self.safety:
            self._command(int(self.registers.get("input_int_register_0", 0)))
        if self.servoing and self.time - self.servoing > self.protective_stop_at:
            self._end("protective stop")
            self.safety = PROTECTIVE
        if self.watched and self.servoing and time.monotonic() - self.fed > 1.0:
            self._end("watchdog")
        if self.running and self.servoing:
            jammed = self.time - self.servoing > self.jam_at
            target = self.arm.target if jammed else self._six()
        else:  # movej, or standing
            far = 0.1 * self.arm.period
            target = self.arm.target + np.clip(self.goal - self.arm.target, -far, far)
        self.arm.step(target)
        self.moved = max(self.moved, float(np.abs(self.arm.v).max()))
        if self.servoing and self.time - self.servoing > self.hang_up_at:
            self._hang_up()

    def _six(self) -> np.ndarray:
        return np.array([self.registers[f"input_double_register_{i}"] for i in range(6)])

    def _command(self, command: int) -> None:
        if command == SERVOJ:
            self.servoing = self.servoing or self.time
            self.registers["output_int_register_0"] = READY
        elif command == 0:
            self.executing = False
            self.registers["output_int_register_0"] = READY
        elif not self.executing:
            self.executing = True
            self.registers["output_int_register_0"] = DONE
            if command == MOVEJ:
                self.goal = self._six()
                self.moved_to = self.goal, self.registers["input_double_register_6"]
            elif command == JOINTS_WITHIN:
                self.registers["output_int_register_1"] = np.abs(self._six()).max() < self.limit
            elif command == SET_WATCHDOG:
                self.watched = True
            elif command == SERVO_STOP:
                self.servoing, self.goal = 0.0, self.arm.target
            elif command == STOP_SCRIPT:
                self._end("script")

    def _end(self, reason: str) -> None:
        self.running, self.servoing, self.goal = False, 0.0, self.arm.target
        self.ended = self.ended or reason

    def _hang_up(self) -> None:
        with self.lock:
            for client, _ in self.clients:
                client.close()
            self.clients = []

    def _tell(self) -> None:
        values = {
            "timestamp": (self.time,),
            "actual_q": self.arm.q,
            "actual_qd": self.arm.v,
            "actual_current": self.arm.torque() / TORQUE_PER_AMPERE,
            "joint_temperatures": np.full(6, 25.0),
            "target_moment": np.zeros(6),
            "robot_mode": (7,),
            "safety_mode": (3 if self.safety else 1,),
            "safety_status_bits": (self.safety or 1,),
            "robot_status_bits": (1 | 2 * self.running,),
            "runtime_state": (PLAYING if self.running else STOPPED,),
            "speed_scaling": (1.0,),
            "target_speed_fraction": (self.scaling,),
        }
        for client, names in list(self.clients):
            body = b"\x01"
            for name in names:
                value = values.get(name, (self.registers.get(name, 0),))
                kind = int if _type(name) in ("INT32", "UINT32") else float
                body += struct.pack(">" + _PACKED[_type(name)], *map(kind, value))
            try:
                client.sendall(struct.pack(">Hc", 3 + len(body), b"U") + body)
            except OSError:
                self.clients.remove((client, names))


def _packages(client: socket.socket) -> Iterator[tuple[bytes, bytes]]:
    """Type and payload of each package."""
    stream = client.makefile("rb")
    while len(header := stream.read(3)) == 3:
        size, kind = struct.unpack(">Hc", header)
        yield kind, stream.read(size - 3)
