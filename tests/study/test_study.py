"""A study over stand-ins of cases: failures, what is kept, what is done again."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from excite_cli.errors import FileError, NoAdmissibleMotionError
from excite_cli.study.case import DoneCase, StudyCase, StudyTask
from excite_cli.study.study import StudyNews, run_study

TASK = StudyTask(Path("arm.yaml"), ())
CASES = [StudyCase(f"seed-{k}", {"seed": str(k)}, None, f"request {k}") for k in (1, 2, 3)]


class Done:
    """Stands for `do_case`; the second case fails while `broken`."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.broken: Exception | None = NoAdmissibleMotionError("nothing fits")

    def __call__(self, task: StudyTask, case: StudyCase, tell: Any) -> DoneCase:
        self.names.append(case.name)
        if case.name == "seed-2" and self.broken:
            raise self.broken
        figures = {"condition_number": 10.0 - int(case.values["seed"]), "status": "converged"}
        return DoneCase(figures, {"motions.h5": case.name.encode()}, 0.5)


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> Done:
    found = Done()
    monkeypatch.setattr("excite_cli.study.study.do_case", found)
    return found


def test_a_failing_case_is_a_row(done: Done, tmp_path: Path) -> None:
    heard: list[StudyNews] = []
    records = run_study(TASK, CASES, tmp_path / "s", report=heard.append)
    assert [record.failed for record in records] == [False, True, False]
    assert [news.done for news in heard] == [1, 2, 3]
    assert [news.best for news in heard] == [9.0, 9.0, 7.0]
    rows = list(csv.DictReader((tmp_path / "s" / "study.csv").open()))
    assert [row["condition_number"] for row in rows] == ["9.0", "", "7.0"]
    assert [row["error"] for row in rows] == ["", "nothing fits", ""]
    assert (tmp_path / "s" / "seed-3.motions.h5").read_bytes() == b"seed-3"
    assert json.loads((tmp_path / "s" / "seed-2.json").read_text())["message"] == "nothing fits"


def test_a_bug_in_a_case_says_that_it_is_one(done: Done, tmp_path: Path) -> None:
    done.broken = KeyError("shoulder")
    assert "a bug of excite" in run_study(TASK, CASES, tmp_path)[1].message


def test_resume_does_what_is_missing_or_failed(done: Done, tmp_path: Path) -> None:
    run_study(TASK, CASES[:2], tmp_path)
    done.names.clear()
    done.broken = None
    records = run_study(TASK, CASES, tmp_path, resume=True)
    assert done.names == ["seed-2", "seed-3"]
    assert [record.figures["condition_number"] for record in records] == [9.0, 8.0, 7.0]
    (tmp_path / "seed-1.motions.h5").unlink()
    done.names.clear()
    run_study(TASK, CASES, tmp_path, resume=True)
    assert done.names == ["seed-1"], "a case without its file is not complete"


def test_a_folder_is_not_written_over(done: Done, tmp_path: Path) -> None:
    run_study(TASK, CASES[:1], tmp_path)
    with pytest.raises(FileError, match="holds a study already"):
        run_study(TASK, CASES, tmp_path)
    (tmp_path / "study.csv").unlink()  # as after an interruption
    with pytest.raises(FileError, match="Go on with --resume"):
        run_study(TASK, CASES, tmp_path)
    other = [StudyCase("seed-1", {"seed": "1"}, None, "another config")]
    with pytest.raises(FileError, match="another config or log"):
        run_study(TASK, other, tmp_path, resume=True)
    (tmp_path / "seed-1.json").write_text("{")
    with pytest.raises(FileError, match="damaged"):
        run_study(TASK, CASES, tmp_path, resume=True)


def test_an_interrupted_study_keeps_what_was_done(done: Done, tmp_path: Path) -> None:
    def stop(news: StudyNews) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(TASK, CASES, tmp_path, report=stop)
    done.names.clear()
    run_study(TASK, CASES, tmp_path, resume=True)
    assert done.names == ["seed-2", "seed-3"]
