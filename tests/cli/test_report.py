"""`excite report`, driven as a user would."""

import shutil
import sys
from pathlib import Path

import h5py
import pytest

from tests.cli.program import SMOKE, Program

CONFIG = ("--config", SMOKE)
NAMES = {"condition_numbers", "spectrum", "motion_1", "motion_2", "margins_1", "margins_2"}
OUTPUTS = ["folder", "taken", "taken.html", "taken.pdf"]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_writes_a_page(two_joints: Path, excite: Program) -> None:
    answer = excite.answer("report", two_joints, "-o", "page.html", *CONFIG)
    assert answer == {"output": "page.html", "figures": [], "doubts": []}
    assert names(excite.folder) == ["page.html"]
    text = (excite.folder / "page.html").read_text()
    assert text.startswith("<!doctype html>")
    for title in ("Condition numbers", "Motions", "Margins", "What shows least", "How it was made"):
        assert f"{title}</h2>" in text
    assert "Made by excite from smoke.h5" in text


def test_the_page_is_named_after_the_file(two_joints: Path, excite: Program) -> None:
    excite.good("report", two_joints, *CONFIG, "--no-picture")
    assert names(excite.folder) == ["smoke-report.html"]
    assert "<img" not in (excite.folder / "smoke-report.html").read_text()
    assert "exists already" in excite.refused("report", two_joints, *CONFIG, "--no-picture")


@pytest.mark.long
@pytest.mark.parametrize(("kind", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_writes_a_folder_of_figures(
    two_joints: Path, excite: Program, kind: str, begins: bytes
) -> None:
    """Where something is there already, nothing is written unless told."""
    folder = excite.folder / "new" / "figures"
    folder.mkdir(parents=True)
    there = folder / f"spectrum.{kind}"
    there.write_text("mine")
    words = ("report", two_joints, "--figures", folder, *CONFIG, "--format", kind)
    assert "exists already" in excite.refused(*words)
    assert there.read_text() == "mine"
    assert names(folder) == [there.name]
    answer = excite.answer(*words, "--overwrite")
    expected = {str(folder / f"{name}.{kind}") for name in NAMES}
    assert answer == {"output": None, "figures": answer["figures"], "doubts": []}
    assert set(answer["figures"]) == expected == {str(path) for path in folder.iterdir()}
    assert all(path.read_bytes().startswith(begins) for path in folder.iterdir())


def test_writes_one_pdf(two_joints: Path, excite: Program) -> None:
    told = excite.good("report", two_joints, "--figures", "new/smoke.pdf", *CONFIG).stdout
    assert told == "new/smoke.pdf\n"
    written = (excite.folder / "new" / "smoke.pdf").read_bytes()
    assert written.startswith(b"%PDF")
    assert f"/Count {len(NAMES)}".encode() in written
    assert names(excite.folder / "new") == ["smoke.pdf"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--figures", "one.png"), "there are 6 figures and .png holds one"),
        (("--figures", "a.pdf", "--format", "svg"), "asks for a PDF and --format for svg"),
        (("--figures", "taken"), "taken is a file"),
        (("--figures", "taken.pdf"), "taken.pdf exists already"),
        (("-o", "page.pdf"), "a report is a page, NAME.html"),
        (("--format", "svg"), "give a folder for them with --figures"),
        (("-o", "taken.html"), "taken.html exists already"),
        (("-o", "folder"), "folder is a folder"),
        (("-o", "x.html", "../none.h5"), "There is no file ../none.h5"),
        (("-o", "x.html", "taken"), "not a readable HDF5 file"),
    ],
)
def test_what_cannot_be_written_or_read(
    two_joints: Path, excite: Program, more: tuple[str, ...], message: str
) -> None:
    (excite.folder / "folder").mkdir()
    for name in OUTPUTS[1:]:
        (excite.folder / name).write_text("mine")
    assert message in excite.refused("report", two_joints, *CONFIG, *more)
    assert names(excite.folder) == OUTPUTS
    assert {(excite.folder / name).read_text() for name in OUTPUTS[1:]} == {"mine"}


def test_a_urdf_that_is_not_found_asks_for_the_config(two_joints: Path, excite: Program) -> None:
    shutil.copy(two_joints, excite.folder / "moved.h5")
    with h5py.File(excite.folder / "moved.h5", "a") as file:
        file.attrs["config_folder"] = str(excite.folder / "gone")
    message = excite.refused("report", "moved.h5")
    assert "../data/smoke_arm.urdf" in message
    assert "--config CONFIG.yaml" in message


def test_a_config_of_another_robot(two_joints: Path, excite: Program) -> None:
    urdf = (SMOKE.parent.parent / "data" / "smoke_arm.urdf").read_text()
    (excite.folder / "arm.urdf").write_text(urdf.replace('mass value="4"', 'mass value="5"'))
    (excite.folder / "other.yaml").write_text("robot: {urdf: arm.urdf}\n")
    message = excite.refused("report", two_joints, "--config", "other.yaml")
    assert "does not fit the robot that was found (arm.urdf)" in message


def test_a_missing_matplotlib(
    two_joints: Path, excite: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    told = excite.refused("report", two_joints, "--figures", "drawn", *CONFIG)
    assert "pip install 'excite-cli[plot]'" in told
