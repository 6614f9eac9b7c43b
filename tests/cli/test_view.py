"""`excite view`, driven as a user would."""

import json
import signal
import sys
from pathlib import Path

import pytest

from excite_cli.view import pictures
from excite_cli.view.studio import QUICK
from tests.cli.program import SMOKE, Program

pytest.importorskip("embreex")
pytest.importorskip("PIL")
SMALL = ("--size", "64x48")


@pytest.fixture(autouse=True)
def _quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "FINE", QUICK)


def test_writes_a_png(two_joints: Path, excite: Program) -> None:
    answer = excite.answer("view", two_joints, "--png", "new/arm.png", *SMALL, "--motion", "2")
    assert (answer["picture"], answer["motion"]) == ("new/arm.png", "motion_2")
    (written,) = (excite.folder / "new").iterdir()
    assert written.read_bytes().startswith(b"\x89PNG")


def test_writes_a_gif(two_joints: Path, excite: Program) -> None:
    words = ("--fps", "5", "--duration", "0.6")
    answer = excite.answer("view", two_joints, "--gif", "arm.gif", *SMALL, *words)
    assert (answer["frames"], answer["seconds"]) == (3, 0.6)
    assert (excite.folder / "arm.gif").read_bytes().startswith(b"GIF89a")
    told = excite.good("view", two_joints, "--gif", "arm.gif", *SMALL, *words, "--overwrite").stdout
    assert "Not modelled: the floor and all else around the robot" in told


def test_a_motion_that_is_no_result_needs_a_config(two_joints: Path, excite: Program) -> None:
    excite.good("export", two_joints, "-o", "m.csv", "--format", "csv", "--motion", "1")
    words = ("view", "m.csv", "--png", "arm.png", *SMALL)
    assert "give --config CONFIG.yaml" in excite.refused(*words)
    excite.good(*words, "--config", SMOKE, "--set", "robot.joints=[elbow, slide]")
    assert (excite.folder / "arm.png").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--png", "a.png", "--gif", "b.gif"), "give one of them"),
        (("--png", "a.jpg"), "ends in .png"),
        (("--gif", "a.png"), "ends in .gif"),
        (("--png", "taken.png"), "exists already"),
        (("--png", "a.png", "--time", "99"), "ends at 6 s"),
        (("--png", "a.png", "--size", "640"), "give WIDTHxHEIGHT"),
        (("--png", "a.png", "--size", "9x9"), "16 to"),
        (("--png", "a.png", "--view", "35"), "give AZIMUTH,ELEVATION"),
        (("--png", "a.png", "--view", "35,95"), "elevation -90 to 90"),
        (("--png", "a.png", "--motion", "3"), "has no motion 3"),
        (("--png", "a.png", "--set", "seed=2"), "has its own config"),
        (("--host", "192.0.2.1"), "Nothing can be served at 192.0.2.1"),
    ],
)
def test_bad_input(two_joints: Path, excite: Program, words: tuple[str, ...], message: str) -> None:
    (excite.folder / "taken.png").write_text("mine")
    assert message in excite.refused("view", two_joints, *words)
    assert [path.name for path in excite.folder.iterdir()] == ["taken.png"]


@pytest.mark.parametrize("words", [(), ("--png", "taken.png")])
def test_a_missing_file_is_told_first(excite: Program, words: tuple[str, ...]) -> None:
    (excite.folder / "taken.png").write_text("mine")
    assert "There is no file none.h5" in excite.refused("view", "none.h5", *words)


@pytest.mark.parametrize(
    ("module", "words"), [("embreex.rtcore_scene", ("--png", "a.png")), ("viser", ())]
)
def test_a_missing_library_names_the_extra(
    two_joints: Path,
    excite: Program,
    monkeypatch: pytest.MonkeyPatch,
    module: str,
    words: tuple[str, ...],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert "pip install 'excite-cli[view]'" in excite.refused("view", two_joints, *words)


@pytest.mark.long
def test_ctrl_c_exits_with_status_0(two_joints: Path, excite: Program) -> None:
    pytest.importorskip("viser")
    words = ("--no-open", "--json", "--no-progress", "--port", "18080")
    process = excite.start("view", two_joints, *words)
    try:
        assert process.stdout is not None
        answer = json.loads(process.stdout.readline())
        assert answer["url"] == f"http://localhost:{answer['port']}"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 0, err
    assert (out, err.strip()) == ("", "Ended.")
