"""`excite report`, driven as a user would."""

import json
import shutil
import sys
from pathlib import Path

import h5py
import pytest
import typer

from excite_cli.cli.ending import run_guarded
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


def test_writes_a_page(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "page.html"
    assert _run("report", stored, "-o", path, "--config", CONFIG, "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"output": str(path), "figures": [], "doubts": []}
    assert list(tmp_path.iterdir()) == [path]
    text = path.read_text()
    assert text.startswith("<!doctype html>")
    for title in ("Condition numbers", "Motions", "Margins", "What shows least", "How it was made"):
        assert f"{title}</h2>" in text
    assert "Made by excite from smoke.h5" in text


def test_the_page_is_named_after_the_file(
    stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert _run("report", stored, "--config", CONFIG, "--no-picture") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["smoke-report.html"]
    assert "<img" not in (tmp_path / "smoke-report.html").read_text()
    assert _run("report", stored, "--config", CONFIG, "--no-picture") == 2


def test_writes_a_folder_of_figures(
    stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new" / "figures"
    assert _run("report", stored, "--figures", folder, "--config", CONFIG, "--json") == 0
    expected = [folder / f"{name}.png" for name in NAMES]
    written = [str(path) for path in expected]
    assert json.loads(capsys.readouterr().out) == {"output": None, "figures": written, "doubts": []}
    assert sorted(folder.iterdir()) == sorted(expected)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in expected)


def test_writes_figures_in_another_format(stored: Path, tmp_path: Path) -> None:
    figures = ("--figures", tmp_path / "f", "--format", "svg")
    assert _run("report", stored, *figures, "--config", CONFIG) == 0
    written = sorted(path.name for path in (tmp_path / "f").iterdir())
    assert written == sorted(f"{name}.svg" for name in NAMES)


def test_writes_one_pdf(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "smoke.pdf"
    assert _run("report", stored, "--figures", path, "--config", CONFIG) == 0
    assert path.read_bytes().startswith(b"%PDF")
    assert f"/Count {len(NAMES)}".encode() in path.read_bytes()
    assert capsys.readouterr().out.replace("\n", "") == str(path)
    assert list(tmp_path.iterdir()) == [path]


def test_does_not_replace_unless_told(
    stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = tmp_path / "spectrum.png"
    there.write_text("mine")
    arguments = ("report", stored, "--figures", tmp_path, "--config", CONFIG)
    assert _run(*arguments) == 2
    assert "exists already" in capsys.readouterr().err
    assert there.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [there]
    assert _run(*arguments, "--overwrite") == 0
    assert there.read_bytes().startswith(b"\x89PNG")


def test_does_not_replace_a_pdf(stored: Path, tmp_path: Path) -> None:
    there = tmp_path / "smoke.pdf"
    there.write_text("mine")
    assert _run("report", stored, "--figures", there, "--config", CONFIG) == 2
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
    assert _run("report", stored, "--figures", tmp_path / name, "--config", CONFIG, *more) == 2
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("-o", "page.pdf"), "a report is a page, NAME.html"),
        (("--format", "svg"), "give a folder for them with --figures"),
        (("-o", "taken.html"), "taken.html exists already"),
        (("-o", "folder"), "folder is a folder"),
    ],
)
def test_an_output_that_is_no_page(
    stored: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    more: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "taken.html").write_text("mine")
    assert _run("report", stored, "--config", CONFIG, *more) == 2
    assert message in capsys.readouterr().err
    assert (tmp_path / "taken.html").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 2


def test_a_file_given_twice(stored: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run("report", stored, stored) == 2
    assert "is given twice" in capsys.readouterr().err


def test_measured_data_are_no_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "measured.h5"
    with h5py.File(data, "w") as file:
        file.attrs["simulated"] = True
    assert _run("report", data) == 2
    message = capsys.readouterr().err
    assert "holds measured data" in message
    assert "excite diagnose" in message


def test_a_foreign_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    foreign = tmp_path / "foreign.h5"
    foreign.write_text("no HDF5")
    assert _run("report", foreign, "-o", tmp_path / "page.html") == 2
    assert "not a readable HDF5 file" in capsys.readouterr().err
    assert not (tmp_path / "page.html").exists()


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
    assert _run("report", moved, "-o", tmp_path / "page.html") == 2
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
    assert _run("report", stored, "-o", tmp_path / "page.html", "--config", other) == 2
    assert "does not fit the robot that was found (arm.urdf)" in capsys.readouterr().err


def test_a_missing_matplotlib(
    stored: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert _run("report", stored, "--figures", tmp_path / "drawn", "--config", CONFIG) == 2
    assert "pip install 'excite-cli[plot]'" in capsys.readouterr().err
