"""Motions played in the browser: a small server on this machine, with controls and a readout.

One loop does everything that is shown, so that nothing is changed from two sides at once: it reads
the controls, moves the robot on, and writes the readout a few times a second.
"""

import contextlib
import errno
import io
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from excite_cli.errors import ConfigError, optional_module
from excite_cli.excitation.problem import Problem
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fade import Segment
from excite_cli.view.guarded_server import guarded
from excite_cli.view.instants import Instants, instants_of
from excite_cli.view.rays import fitted_camera
from excite_cli.view.scene import build_scene
from excite_cli.view.stage import SceneNodes

# What stands beside the moving robot in the browser: margins and joint positions, as HTML.

_BLUE, _VERMILION, _TRACK = "#0072B2", "#D55E00", "#8884"
_NEAR = 0.05  # share of its scale, or of a range, below which a margin is reported in colour
_TABLE = '<table style="width:100%;font-size:12px;border-collapse:collapse;line-height:1.35">'


def margins_html(instants: Instants, instant: int) -> str:
    """Every constraint with the smallest margin at this instant, and where it is."""
    rows = []
    for track in instants.margins:
        value, share = float(track.values[instant]), float(track.shares[instant])
        colour = _VERMILION if share < _NEAR else "inherit"
        broken = " BROKEN" if value < 0 else ""
        rows.append(
            f"<tr><td>{escape(track.name)}</td>"
            f'<td style="text-align:right;white-space:nowrap;color:{colour}">'
            f"{value:.4g} {escape(track.units[instant])}{broken}</td></tr>"
            f'<tr><td colspan="2" style="opacity:.6;padding:0 0 5px 8px">'
            f"{escape(track.labels[instant])}</td></tr>"
        )
    if not rows:
        return _boxed("This problem has no constraints.")
    return _boxed(f"{_TABLE}{''.join(rows)}</table>")


def nearest_html(instants: Instants, instant: int) -> str:
    """The nearest pair in words."""
    if instants.nearest is None:
        return _boxed("This problem keeps no distances.")
    distance = 1000 * float(instants.nearest.distances[instant])
    label = escape(instants.nearest.labels[instant])
    return _boxed(f'nearest: {label}, <b style="color:{_VERMILION}">{distance:.1f} mm</b>')


def joints_html(problem: Problem, instants: Instants, instant: int) -> str:
    """Every joint with its position on a bar from its lower to its upper limit."""
    robot: Robot = problem.robot
    lower, upper = robot.limits.lower, robot.limits.upper
    rows = []
    for joint, name in enumerate(robot.joint_names):
        q, unit = float(instants.q[instant, joint]), "m" if robot.sliding[joint] else "rad"
        low, high = float(lower[joint]), float(upper[joint])
        bar = _bar((q - low) / (high - low)) if np.isfinite(high - low) else "no limits"
        ends = f"{low:.2f} … {high:.2f}" if np.isfinite(high - low) else ""
        rows.append(
            f'<tr><td title="{ends}">{escape(name)}</td>'
            f'<td style="text-align:right;white-space:nowrap">{q:+.3f} {unit}</td></tr>'
            f'<tr><td colspan="2" style="padding:0 0 4px">{bar}</td></tr>'
        )
    return _boxed(f"{_TABLE}{''.join(rows)}</table>")


def _bar(share: float) -> str:
    near = min(share, 1 - share) < _NEAR
    place = 100 * float(np.clip(share, 0.0, 1.0))
    return (
        f'<div style="position:relative;height:5px;border-radius:3px;background:{_TRACK}">'
        f'<div style="position:absolute;left:calc({place:.1f}% - 4px);top:-2px;width:9px;'
        f'height:9px;border-radius:50%;background:{_VERMILION if near else _BLUE}"></div></div>'
    )


def _boxed(content: str) -> str:
    return f'<div style="padding:2px 14px 6px;font-size:12px">{content}</div>'


_RATE = 50.0  # instants per second of motion
_FRAME = 1 / 30  # [s]
_READOUT = 0.2  # [s] between two readouts while playing
_SEEN = 40  # instants that tell how far a motion reaches
_TRIED = 50  # ports
_PACES = ("0.1", "0.25", "0.5", "1", "2", "4")  # shares of the motion's own pace


@dataclass(frozen=True)
class Serving:
    """Where to serve, and what to show at first.

    mass None: the centre of mass where a constraint asks for balance.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    azimuth: float = 35.0
    elevation: float = 18.0
    capsules: bool = True
    distance: bool = True
    mass: bool | None = None


def play_in_browser(
    problem: Problem,
    segments: Sequence[Segment],
    serving: Serving,
    ready: Callable[[str, int], None],
    going: Callable[[], bool] = lambda: True,
    say: Callable[[str], None] = lambda text: None,
) -> None:
    """Serve the motions of `problem` until interrupted, or as long as `going`.

    `ready` hears the address and the port as soon as the page can be opened; the port is another
    one than requested if that is taken. `say` hears what cannot be shown as the URDF says it.

    Raises
    ------
    MissingExtraError
        viser is not installed.
    ConfigError
        The host or the port cannot be used.
    """
    viser = optional_module(
        "viser",
        "Playing motions in the browser needs viser, which is not installed. Run: "
        "pip install 'excite-cli[view]' (or take --png or --gif).",
    )
    times = np.linspace(0.0, 1.0, _SEEN)
    paths = [
        s.trajectory.states(times * s.trajectory.duration, s.coefficients)[0] for s in segments
    ]
    scene = build_scene(problem, paths)
    if scene.note:
        say(scene.note)
    server = _server(viser, serving, problem.robot.name)
    try:
        camera = fitted_camera(scene.outline, (4, 3), serving.azimuth, serving.elevation, fill=0.75)
        server.initial_camera.position = tuple(camera.eye)
        server.initial_camera.look_at = tuple(scene.center)
        server.initial_camera.fov = float(2 * np.arctan(3 / 2 / camera.focal))
        player = _Player(server, SceneNodes(server, scene), problem, segments, serving)
        player.update(time.monotonic())
        host = "localhost" if serving.host in ("127.0.0.1", "0.0.0.0", "::") else serving.host
        ready(f"http://{host}:{server.get_port()}", server.get_port())
        while going():
            began = time.monotonic()
            player.update(began)
            time.sleep(max(0.001, _FRAME - (time.monotonic() - began)))
    finally:
        _stop(server)


class _Player:
    """The controls, and what follows from them."""

    def __init__(
        self,
        server: Any,
        stage: SceneNodes,
        problem: Problem,
        segments: Sequence[Segment],
        serving: Serving,
    ) -> None:
        self._server, self._stage, self._problem = server, stage, problem
        self._segments = {segment.name: segment for segment in segments}
        self._known: dict[str, Instants] = {}
        self._playing = True
        self._time, self._before = 0.0, time.monotonic()
        self._shown: tuple[str, int] | None = None
        self._told = -np.inf
        gui = server.gui
        names = tuple(self._segments)
        duration = self._segments[names[0]].trajectory.duration
        self._motion = gui.add_dropdown("motion", names, initial_value=names[0])
        self._slider = gui.add_slider("time [s]", 0.0, duration, 1 / _RATE, 0.0)
        self._set = 0.0  # what this program put into the slider: anything else is the user's
        self._button = gui.add_button("pause")
        self._button.on_click(lambda _: self._toggle())
        self._pace = gui.add_dropdown("speed", _PACES, initial_value="1")
        self._toggles = []
        for label, node, shown in (
            ("capsules", stage.capsules, serving.capsules),
            ("nearest distance", stage.distance, serving.distance),
            (
                "centre of mass",
                stage.mass,
                stage.balanced if serving.mass is None else serving.mass,
            ),
        ):
            self._toggles.append((gui.add_checkbox(label, shown), node))
        self._nearest = gui.add_html("")
        with gui.add_folder("smallest margins now"):
            self._margins = gui.add_html("")
        with gui.add_folder("joint positions within limits", expand_by_default=problem.robot.n < 9):
            self._joints = gui.add_html("")

    def _toggle(self) -> None:
        self._playing = not self._playing
        self._button.label = "pause" if self._playing else "play"

    def update(self, now: float) -> None:
        """Read the controls and show what they ask for."""
        name = str(self._motion.value)
        segment = self._segments[name]
        duration = segment.trajectory.duration
        if self._slider.max != duration:
            self._slider.max, self._time = duration, 0.0
        if abs(float(self._slider.value) - self._set) > 0.5 / _RATE:
            self._time = float(self._slider.value)
        elif self._playing:
            pace = float(self._pace.value)
            self._time = (self._time + pace * (now - self._before)) % duration
        self._before = now
        instants = self._instants(name)
        instant = instants.index_at(self._time)
        for box, node in self._toggles:
            if node.visible != box.value:
                node.visible = box.value
        if self._shown == (name, instant):
            return
        self._shown = name, instant
        with self._server.atomic():
            self._stage.show(instants, instant)
        if not self._playing or now - self._told > _READOUT:
            self._told = now
            self._set = round(self._time * _RATE) / _RATE
            self._slider.value = self._set
            self._nearest.content = nearest_html(instants, instant)
            self._margins.content = margins_html(instants, instant)
            self._joints.content = joints_html(self._problem, instants, instant)

    def _instants(self, name: str) -> Instants:
        if name not in self._known:
            segment = self._segments[name]
            duration = segment.trajectory.duration
            times = np.linspace(0.0, duration, int(np.ceil(duration * _RATE)) + 1)
            self._known[name] = instants_of(self._problem, segment, times)
        return self._known[name]


def _server(viser: Any, serving: Serving, title: str) -> Any:
    """A server that says nothing of its own and is shared with nobody outside."""
    port = _free_port(serving.host, serving.port)
    with contextlib.redirect_stdout(io.StringIO()), guarded(serving.host):
        server = viser.ViserServer(serving.host, port, label=title, verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
    server.request_share_url = lambda *_, **__: None
    return server


def _stop(server: Any) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _free_port(host: str, port: int) -> int:
    """The port, or the next free one.

    Raises
    ------
    ConfigError
        This machine has no such address, or none of the next ports is free.
    """
    reason = "no port there is free"
    for candidate in range(port, min(port + _TRIED, 65536)):
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            with socket.socket(family, socket.SOCK_STREAM) as probe:
                # As the server itself does: a port that was closed a moment ago is free.
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((host, candidate))
            return candidate
        except OSError as error:
            reason = error.strerror or str(error)
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                break
    raise ConfigError(
        f"Nothing can be served at {host}, port {port}: {reason}. Give another --port, or as "
        "--host an address of this machine (127.0.0.1: for it only; 0.0.0.0: for its network)."
    )
