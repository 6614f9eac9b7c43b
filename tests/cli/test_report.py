"""`excite report`, driven as a user would."""

import json
import shutil
import sys
from pathlib import Path

import h5py
import pytest
import typer

from excite_cli.cli.console import run_guarded
from excite_cli.cli.optimize import optimize
from excite_cli.cli.report import report

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
NAMES = ["condition_numbers", "spectrum", "motion_1", "margins_1"]


def _run(*arguments: str | Path) -> int:
    """Exit status of one command line."""
    app = typer.Typer()
    app.command("optimize")(optimize)
    app.command("report")(report)
    command = typer.main.get_command(app)
    words = [str(argument) for argument in arguments]
    return run_guarded(lambda: command.main(words, standalone_mode=False))


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "smoke.h5"
    small = (
        "optimizer.max_iterations=10",
        "constraints.self_collision=null",
        "robot.joints=[elbow, slide]",
    )
    options = [word for value in small for word in ("--set", value)]
    assert _run("optimize", CONFIG, "-o", path, "--motions", "1", "--quiet", *options) == 0
    return path


def test_writes_a_folder(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "new" / "figures"
    assert _run("report", stored, "-o", folder, "--config", CONFIG, "--json") == 0
    expected = [folder / f"{name}.png" for name in NAMES]
    assert json.loads(capsys.readouterr().out) == {"figures": [str(path) for path in expected]}
    assert sorted(folder.iterdir()) == sorted(expected)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in expected)


def test_the_folder_is_named_after_the_file(
    stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert _run("report", stored, "--config", CONFIG, "--format", "svg") == 0
    written = sorted(path.name for path in (tmp_path / "smoke-report").iterdir())
    assert written == sorted(f"{name}.svg" for name in NAMES)


def test_writes_one_pdf(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "smoke.pdf"
    assert _run("report", stored, "-o", path, "--config", CONFIG) == 0
    assert path.read_bytes().startswith(b"%PDF")
    assert f"/Count {len(NAMES)}".encode() in path.read_bytes()
    assert capsys.readouterr().out.replace("\n", "") == str(path)
    assert list(tmp_path.iterdir()) == [path]


def test_does_not_replace_unless_told(
    stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = tmp_path / "spectrum.png"
    there.write_text("mine")
    arguments = ("report", stored, "-o", tmp_path, "--config", CONFIG)
    assert _run(*arguments) == 2
    assert "exists already" in capsys.readouterr().err
    assert there.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [there]
    assert _run(*arguments, "--overwrite") == 0
    assert there.read_bytes().startswith(b"\x89PNG")


def test_does_not_replace_a_pdf(stored: Path, tmp_path: Path) -> None:
    there = tmp_path / "smoke.pdf"
    there.write_text("mine")
    assert _run("report", stored, "-o", there, "--config", CONFIG) == 2
    assert there.read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "more", "message"),
    [
        ("one.png", (), "there are 4 figures and .png holds one"),
        ("all.pdf", ("--format", "svg"), "asks for a PDF and --format for svg"),
        ("taken", (), "taken is a file"),
    ],
)
def test_an_output_that_does_not_fit(
    stored: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    more: tuple[str, ...],
    message: str,
) -> None:
    (tmp_path / "taken").touch()
    assert _run("report", stored, "-o", tmp_path / name, "--config", CONFIG, *more) == 2
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_a_foreign_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    foreign = tmp_path / "foreign.h5"
    foreign.write_text("no HDF5")
    assert _run("report", foreign, "-o", tmp_path / "figures") == 2
    assert "not a readable HDF5 file" in capsys.readouterr().err
    assert not (tmp_path / "figures").exists()


def test_a_missing_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run("report", tmp_path / "none.h5") == 2
    assert "There is no file" in capsys.readouterr().err


def test_a_urdf_that_is_not_found_asks_for_the_config(
    stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = tmp_path / "moved.h5"
    shutil.copy(stored, moved)
    with h5py.File(moved, "a") as file:
        file.attrs["config_folder"] = str(tmp_path / "gone")
    assert _run("report", moved, "-o", tmp_path / "figures") == 2
    message = capsys.readouterr().err
    assert "../data/smoke_arm.urdf" in message
    assert "--config CONFIG.yaml" in message


def test_a_config_of_another_robot(
    stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = (CONFIG.parent.parent / "data" / "smoke_arm.urdf").read_text()
    (tmp_path / "arm.urdf").write_text(urdf.replace('mass value="4"', 'mass value="5"'))
    other = tmp_path / "other.yaml"
    other.write_text("robot: {urdf: arm.urdf}\n")
    assert _run("report", stored, "-o", tmp_path / "figures", "--config", other) == 2
    assert "does not fit the robot that was found (arm.urdf)" in capsys.readouterr().err


def test_a_missing_matplotlib(
    stored: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert _run("report", stored, "-o", tmp_path / "figures", "--config", CONFIG) == 2
    assert "pip install 'excite-cli[plot]'" in capsys.readouterr().err
