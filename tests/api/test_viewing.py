"""Motions shown from Python."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from excite_cli import (
    ConfigError,
    FileError,
    Note,
    View,
    draw_motion,
    motions_of,
    read_result,
    view_motions,
)
from excite_cli.api import viewing
from tests.api.conftest import SMALL, SMOKE, Loop


def test_what_is_no_motion_is_one_sentence(loop: Loop, tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    for take in (view_motions, lambda motions, *more: draw_motion(motions, target, *more)):
        with pytest.raises(FileError, match=r"fit\.h5 holds a fit, not a result"):
            take(loop.fit)
        with pytest.raises(FileError, match=r"data\.h5 is not a result file, so the robot is"):
            take(loop.data)
        with pytest.raises(FileError, match="do not say which robot moves"):
            take(motions_of(read_result(loop.result)))
        with pytest.raises(ConfigError, match="--set: a result file has its own config"):
            take(loop.result, None, SMALL)
        with pytest.raises(ConfigError, match="the robot has no joint 'elbow'"):
            take(loop.result, SMOKE.parent / "ur10.yaml")
    assert not list(tmp_path.iterdir())


def test_pictures_have_names_that_say_what_they_are(loop: Loop, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"give a name that ends in \.png or \.gif"):
        draw_motion(loop.result, tmp_path / "a.jpg")
    with pytest.raises(ConfigError, match="--size 2x48: give WIDTHxHEIGHT in pixels, 16 to 4096"):
        draw_motion(loop.result, tmp_path / "b.png", look=View(size=(2, 48)))
    with pytest.raises(ConfigError, match="--fps 0: give 1 to 50"):
        draw_motion(loop.result, tmp_path / "b.gif", fps=0.0)
    with pytest.raises(ConfigError, match="--duration 1000: give a length up to 120 s"):
        draw_motion(loop.result, tmp_path / "b.gif", seconds=1000.0)
    with pytest.raises(FileError, match="There is no motion to show"):
        draw_motion([], tmp_path / "b.png", loop.problem)


def test_a_motion_at_hand_is_drawn(loop: Loop, tmp_path: Path) -> None:
    pytest.importorskip("embreex")
    pytest.importorskip("PIL")
    frames: list[tuple[int, int]] = []
    motion = motions_of(read_result(loop.result))[1]
    found = draw_motion(
        motion,
        tmp_path / "a.gif",
        loop.problem,
        look=View(size=(64, 48)),
        fps=2.0,
        seconds=1.5,
        progress=lambda text, done, total: frames.append((done, total)),
    )
    assert (found.motion, found.frames, found.seconds) == ("motion_2", 3, 1.5)
    assert frames == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert found.path.read_bytes()[:4] == b"GIF8"
    assert found.path.stat().st_size == found.size


def test_ctrl_c_ends_it_and_a_taken_port_is_told(
    loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[Any] = []

    def served(
        problem: Any, segments: Any, serving: Any, ready: Callable[[str, int], None], say: Any
    ) -> None:
        shown.extend(segment.name for segment in segments)
        ready("http://localhost:8081", 8081)
        raise KeyboardInterrupt

    monkeypatch.setattr(viewing, "play_in_browser", served)
    monkeypatch.setattr(viewing.webbrowser, "open", lambda url: shown.append(url))
    told: list[Note] = []
    heard: list[tuple[str, int]] = []
    view_motions(
        read_result(loop.result),
        loop.problem,
        chosen=[2],
        ready=lambda url, port: heard.append((url, port)),
        tell=told.append,
    )
    assert shown == ["motion_2", "http://localhost:8081"]
    assert heard == [("http://localhost:8081", 8081)]
    assert [note.sentence for note in told] == [
        "Port 8080 is taken; 8081 is the next free one.",
        "Ended.",
    ]
