"""SKILL.md is followed to the letter from an empty folder, with plans that are cut short."""

from pathlib import Path

import pytest

from tests.cli.program import ROOT, Program
from tests.docs.console import read_page, words_of
from tests.docs.test_commands import SHORTER

pytest.importorskip("mujoco")

SKILL = ROOT / "SKILL.md"
ORDER = ("init", "inspect", "optimize", "check", "simulate", "inspect", "diagnose", "report")
QUICK = {
    **SHORTER,
    "optimize": (*SHORTER["optimize"], "--motions", "2", "--set", "sampling.cost={samples: 40}"),
    "simulate": ("--rate", "100"),
}


def test_the_page_is_followed_from_an_empty_folder(tmp_path: Path) -> None:
    folder = tmp_path / "work"
    folder.mkdir()
    excite = Program(folder, tmp_path / "cache")
    page = read_page(SKILL)
    assert page.needs == ()
    assert tuple(words_of(each.line)[1] for each in page.commands) == (*ORDER, "report")
    for command in page.commands:
        before = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
        _, verb, *given = words_of(command.line)
        run = excite(verb, *given, *QUICK.get(verb, ()))
        assert run.returncode == command.status, f"{command.line}\n{run.stderr[-2000:]}"
        assert before.items() <= {p: p.stat().st_mtime_ns for p in folder.iterdir()}.items()
        if verb == "diagnose":
            assert "Coulomb friction of elbow_joint" in run.stdout
    names = ("arm.yaml", "better.yaml", "diagnosis.h5", "measured.h5", "motions.h5", "report.html")
    assert {*names} <= {path.name for path in folder.iterdir()}


def test_every_status_of_the_program_is_in_the_table() -> None:
    told = SKILL.read_text(encoding="utf-8")
    for status in ("0", "1 of `check`", "2", "70", "130"):
        assert f"| {status} |" in told
    assert len(told.splitlines()) < 110  # one page
