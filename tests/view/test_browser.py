import socket
import time
import urllib.request
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.errors import ConfigError
from excite_cli.excitation.problem import Problem
from excite_cli.trajectory.fade import Segment
from excite_cli.view.browser import (
    Serving,
    _Player,
    _server,
    _stop,
    joints_html,
    margins_html,
    nearest_html,
    play_in_browser,
)
from excite_cli.view.instants import instants_of
from excite_cli.view.scene import build_scene
from excite_cli.view.stage import SceneNodes, _quaternion

viser = pytest.importorskip("viser")


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_serves_a_page_until_it_ends(
    problem: Problem, segment: Segment, port: int, capsys: pytest.CaptureFixture[str]
) -> None:
    seen: dict[str, Any] = {}

    def ready(url: str, at: int) -> None:
        with urllib.request.urlopen(url.replace("localhost", "127.0.0.1"), timeout=10) as page:
            seen.update(status=page.status, text=page.read().decode(), port=at)

    rounds = iter([True, True, False])
    play_in_browser(problem, [segment], Serving(port=port), ready, lambda: next(rounds))
    assert seen["status"] == 200
    assert seen["port"] == port
    assert "<html" in seen["text"]
    assert capsys.readouterr().out == ""
    with socket.socket() as probe:  # nothing is left behind
        assert probe.connect_ex(("127.0.0.1", port)) != 0


def test_an_address_of_another_machine_and_a_port_that_is_taken(
    problem: Problem, segment: Segment, port: int
) -> None:
    found: list[int] = []

    def play(**serving: Any) -> None:
        given = Serving(**serving)
        play_in_browser(problem, [segment], given, lambda _, at: found.append(at), lambda: False)

    with pytest.raises(ConfigError, match=r"Nothing can be served at 192\.0\.2\.1"):
        play(host="192.0.2.1")
    with socket.socket() as other:
        other.bind(("127.0.0.1", port))
        other.listen()
        play(port=port)
    assert found[0] > port


def test_the_player_moves_the_robot(problem: Problem, segment: Segment, port: int) -> None:
    times = np.linspace(0.0, 6.0, 5)
    scene = build_scene(
        problem, [segment.trajectory.states(times, segment.coefficients)[0]], cell=0.01
    )
    server = _server(viser, Serving(port=port), "arm")
    try:
        stage = SceneNodes(server, scene)
        assert stage.ground.text == "floor at -0.6 m"
        assert stage.ground.position[2] == -0.6
        longer = replace(segment, name="slow", trajectory=segment.trajectory.slowed(0.5))
        player = _Player(server, stage, problem, [segment, longer], Serving())
        began = time.monotonic()
        player.update(began)
        player.update(began + 2.0)
        expected = instants_of(problem, segment, np.array([player._time]))
        assert 1.9 < player._time < 2.2
        joint, frame = list(stage._frames["robot"].items())[-1]
        near = expected.poses.translations[0, joint]
        np.testing.assert_allclose(frame.position, near, atol=0.03)
        assert f"{player._known['motion_1'].nearest.distances[player._shown[1]] * 1000:.0f} mm" == (
            stage._value.text
        )
        player._toggle()
        player.update(began + 3.0)
        held = player._time
        player.update(began + 4.0)
        assert player._time == held
        player._slider.value = 4.0
        player._toggles[0][0].value = False
        player.update(began + 5.0)
        assert player._time == 4.0
        assert not stage.capsules.visible
        player._motion.value = "slow"
        player.update(began + 6.0)
        assert player._slider.max == 12.0
        assert player._shown == ("slow", 0)
    finally:
        _stop(server)


def test_quaternions() -> None:
    rng = np.random.default_rng(0)
    fours = rng.normal(size=(20, 4))
    fours /= np.linalg.norm(fours, axis=1, keepdims=True)
    turns = [pin.Quaternion(*four).matrix() for four in fours]
    turns += [np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1]), np.eye(3)]
    for turn in turns:
        w, x, y, z = _quaternion(turn)
        np.testing.assert_allclose(pin.Quaternion(w, x, y, z).matrix(), turn, atol=1e-12)


def test_the_readout(problem: Problem, segment: Segment) -> None:
    instants = instants_of(problem, segment, np.array([0.0, 2.0]))
    margins = margins_html(instants, 1)
    for track in instants.margins:
        assert track.name in margins
        assert f"{track.values[1]:.4g}" in margins
    assert ("BROKEN" in margins) == any(t.values[1] < 0 for t in instants.margins)
    assert instants.nearest is not None
    assert f"{1000 * instants.nearest.distances[1]:.1f} mm" in nearest_html(instants, 1)
    joints = joints_html(problem, instants, 1)
    for name, q in zip(problem.robot.joint_names, instants.q[1], strict=True):
        assert name in joints
        assert f"{q:+.3f}" in joints
    without = replace(instants, nearest=None, margins=())
    assert "no distances" in nearest_html(without, 0)
    assert "no constraints" in margins_html(without, 0)
