"""What functions of the library do beside the mathematics: notes, files, claims."""

import logging
import subprocess
import sys
from pathlib import Path

import pytest

from excite_cli import (
    Level,
    Note,
    Problem,
    Result,
    check,
    load_motions,
    load_problem,
    motions_of,
    plan,
    read_result,
)
from tests.api.conftest import BRIEF, SMOKE, Loop


def test_nothing_is_printed_and_notes_go_to_the_log(
    capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, logger="excite"):
        problem = load_problem(SMOKE, BRIEF)
        result = plan(problem)
        check(problem, result, meshes=False, rate=20.0)
    assert capsys.readouterr() == ("", "")
    assert any("26 base parameters" in text for text in caplog.messages)
    assert any(text.startswith("motion 1: condition number") for text in caplog.messages)


def test_who_listens_hears_notes_with_levels() -> None:
    heard: list[Note] = []
    load_problem(str(SMOKE), [*BRIEF, "uncertainty={mass: 0.1}", "constraints={}"], heard.append)
    levels = {note.level for note in heard}
    assert {Level.INFO, Level.DETAIL, Level.WARNING} <= levels
    (doubt,) = [note for note in heard if note.level is Level.WARNING]
    assert doubt.sentence.startswith("warning: uncertainty bounds nothing")


def test_a_plan_is_gone_on_with(problem: Problem, stored: Path, tmp_path: Path) -> None:
    path = tmp_path / "more.h5"
    path.write_bytes(stored.read_bytes())
    heard: list[Note] = []
    more = load_problem(SMOKE, [*BRIEF[:1], "sequence.motions=2", *BRIEF[2:]])
    result = plan(more, output=str(path), resume=True, tell=heard.append)
    assert [motion.index for motion in result.motions] == [1, 2]
    assert f"resuming after motion 1 of {path}" in [note.text for note in heard]
    assert len(read_result(path).motions) == 2
    assert list(tmp_path.iterdir()) == [path]


def test_motions_of_any_origin_are_the_same(problem: Problem, result: Result, stored: Path) -> None:
    expected = [motion.coefficients.tolist() for motion in motions_of(result)]
    for given in (result, motions_of(result), motions_of(result)[0], stored, str(stored)):
        found = load_motions(problem, given)
        assert [motion.coefficients.tolist() for motion in found] == expected


def test_inspections_are_a_mapping(problem: Problem, result: Result, stored: Path) -> None:
    found = check(problem, result, rate=50.0, meshes=False)
    assert list(found) == ["motion_1"]
    assert found["motion_1"].violations == found.violations == 0
    assert found.difference("motion_1").share == 0.0
    seen: list[tuple[int, int]] = []
    same = check(
        problem, stored, rate=50.0, meshes=False, progress=lambda *counts: seen.append(counts)
    )
    assert seen == [(0, 1)]
    assert same["motion_1"].margins == found["motion_1"].margins


@pytest.mark.long
def test_a_file_that_is_read_first_is_shown_as_a_table(loop: Loop) -> None:
    """Whatever else a notebook has imported before: in a process of its own, nothing."""
    for read, path in (("read_result", loop.result), ("read_fit", loop.fit)):
        code = f"import excite_cli; print(excite_cli.{read}({str(path)!r})._repr_html_())"
        shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert "<table" in shown.stdout, shown.stderr
