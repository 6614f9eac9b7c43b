"""`excite view`, driven as a user would."""

import json
import signal
import sys
from pathlib import Path

import pytest
import typer

from excite_cli.cli.ending import run_guarded
from excite_cli.cli.export import export
from excite_cli.cli.optimize import optimize
from excite_cli.cli.view import view
from excite_cli.view import pictures
from excite_cli.view.studio import QUICK
from tests.cli.program import SMOKE, Program

pytest.importorskip("embreex")
pytest.importorskip("PIL")
SMALL = ("--size", "64x48")


def _run(*arguments: str | Path) -> int:
    """Exit status of one command line."""
    app = typer.Typer()
    for command in (optimize, view, export):
        app.command(command.__name__)(command)
    program = typer.main.get_command(app)
    words = [str(argument) for argument in arguments]
    return run_guarded(lambda: program.main(words, standalone_mode=False))


@pytest.fixture(autouse=True)
def _quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "FINE", QUICK)


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "smoke.h5"
    small = (
        "optimizer.max_iterations=5",
        "constraints.self_collision=null",
        "robot.joints=[elbow, slide]",
    )
    options = [word for value in small for word in ("--set", value)]
    assert _run("optimize", SMOKE, "-o", path, "--motions", "2", "--quiet", *options) == 0
    return path


def test_writes_a_png(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "new" / "arm.png"
    assert _run("view", stored, "--png", target, *SMALL, "--motion", "2", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["picture"] == str(target)
    assert answer["motion"] == "motion_2"
    assert target.read_bytes().startswith(b"\x89PNG")
    assert list(target.parent.iterdir()) == [target]


def test_writes_a_gif(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "arm.gif"
    words = ("--fps", "5", "--duration", "0.6", "--json")
    assert _run("view", stored, "--gif", target, *SMALL, *words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["frames"], answer["seconds"]) == (3, 0.6)
    assert target.read_bytes().startswith(b"GIF89a")


def test_a_motion_that_is_no_result_needs_a_config(
    stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motion = tmp_path / "motion.csv"
    assert _run("export", stored, "-o", motion, "--format", "csv", "--motion", "1", "-q") == 0
    target = tmp_path / "arm.png"
    assert _run("view", motion, "--png", target, *SMALL) == 2
    assert "give --config CONFIG.yaml" in capsys.readouterr().err
    same = ("--config", SMOKE, "--set", "robot.joints=[elbow, slide]")
    assert _run("view", motion, "--png", target, *SMALL, *same, "--quiet") == 0
    assert target.exists()


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
def test_bad_input(
    stored: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken.png").write_text("mine")
    assert _run("view", stored, *words) == 2
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["taken.png"]


def test_a_missing_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken.png").write_text("mine")
    for words in ((), ("--png", str(tmp_path / "taken.png"))):
        assert _run("view", tmp_path / "none.h5", *words) == 2
        assert "There is no file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("module", "words"), [("embreex.rtcore_scene", ("--png", "a.png")), ("viser", ())]
)
def test_a_missing_library_names_the_extra(
    stored: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    module: str,
    words: tuple[str, ...],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert _run("view", stored, *words) == 2
    assert "pip install 'excite-cli[view]'" in capsys.readouterr().err


def test_ctrl_c_exits_with_status_0(stored: Path, excite: Program) -> None:
    pytest.importorskip("viser")
    process = excite.start("view", stored, "--no-open", "--json", "--port", "18080")
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
