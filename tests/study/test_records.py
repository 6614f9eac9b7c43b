"""A study over stand-ins of cases: failures, what is kept, what is done again."""

import csv
import fcntl
import json
from pathlib import Path
from typing import Any

import pytest

from excite_cli.errors import FileError, NoAdmissibleMotionError
from excite_cli.study.case import DoneCase, StudyCase, StudyTask
from excite_cli.study.records import StudyNews, run_study

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
def done() -> Done:
    return Done()


def test_a_failing_case_is_a_row(done: Done, tmp_path: Path) -> None:
    heard: list[StudyNews] = []
    records = run_study(TASK, CASES, tmp_path / "s", done, report=heard.append)
    assert [record.failed for record in records] == [False, True, False]
    assert [news.done for news in heard] == [1, 2, 3]
    assert [news.best for news in heard] == [9.0, 9.0, 7.0]
    rows = list(csv.DictReader((tmp_path / "s" / "study.csv").read_text().splitlines()))
    assert [row["condition_number"] for row in rows] == ["9.0", "", "7.0"]
    assert [row["error"] for row in rows] == ["", "nothing fits", ""]
    assert (tmp_path / "s" / "seed-3.motions.h5").read_bytes() == b"seed-3"
    assert json.loads((tmp_path / "s" / "seed-2.json").read_text())["message"] == "nothing fits"
    done.broken = KeyError("shoulder")
    assert "a bug of excite" in run_study(TASK, CASES, tmp_path, done)[1].message


def test_resume_does_what_is_missing_or_failed(done: Done, tmp_path: Path) -> None:
    run_study(TASK, CASES[:2], tmp_path, done)
    done.names.clear()
    done.broken = None
    records = run_study(TASK, CASES, tmp_path, done, resume=True)
    assert done.names == ["seed-2", "seed-3"]
    assert [record.figures["condition_number"] for record in records] == [9.0, 8.0, 7.0]
    (tmp_path / "seed-1.motions.h5").unlink()
    done.names.clear()
    run_study(TASK, CASES, tmp_path, done, resume=True)
    assert done.names == ["seed-1"], "a case without its file is not complete"


def test_a_folder_is_not_written_over(done: Done, tmp_path: Path) -> None:
    run_study(TASK, CASES[:1], tmp_path, done)
    other = [StudyCase("seed-1", {"seed": "1"}, None, "another config")]
    for left in ("study.csv", "seed-1.json", "seed-1.motions.h5"):
        for cases in (CASES, other):
            with pytest.raises(FileError, match=rf"^\S+{left} exists already.*--resume"):
                run_study(TASK, cases, tmp_path, done)
        if left == "seed-1.json":
            with pytest.raises(
                FileError, match=r"^--resume: .*another config, robot, log or settings"
            ):
                run_study(TASK, other, tmp_path, done, resume=True)
        (tmp_path / left).unlink()
    run_study(TASK, CASES[:1], tmp_path, done)


def stop(news: StudyNews) -> None:
    raise KeyboardInterrupt


def test_with_overwrite_all_is_done_again(done: Done, tmp_path: Path) -> None:
    run_study(TASK, CASES[:1], tmp_path, done)

    other = [StudyCase(c.name, c.values, None, f"another {c.request}") for c in CASES]
    with pytest.raises(KeyboardInterrupt):
        run_study(TASK, other[2:], tmp_path, done, report=stop, overwrite=True)
    assert not (tmp_path / "study.csv").exists()
    done.names.clear()
    run_study(TASK, other, tmp_path, done, overwrite=True)
    assert done.names == ["seed-1", "seed-2", "seed-3"]


@pytest.mark.parametrize(
    "record",
    ["{", "[]", '{"schema": 1}', "FIGURES", "FILES", "[" * 100_000],
    ids=lambda record: record[:9],
)
def test_a_damaged_record_is_none(record: str, done: Done, tmp_path: Path) -> None:
    run_study(TASK, CASES[:1], tmp_path, done)
    path = tmp_path / "seed-1.json"
    stored = json.loads(path.read_text())
    if record in ("FIGURES", "FILES"):
        record = json.dumps({**stored, record.lower(): [1]})
    path.write_text(record)
    done.names.clear()
    run_study(TASK, CASES[:1], tmp_path, done, resume=True)
    assert done.names == ["seed-1"]
    assert json.loads(path.read_text()) == stored


def test_two_studies_in_one_folder_are_refused(done: Done, tmp_path: Path) -> None:
    with (tmp_path / ".study.csv.lock").open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(FileError, match="another run"):
            run_study(TASK, CASES, tmp_path, done)
    assert done.names == []


def test_an_interrupted_study_keeps_what_was_done(done: Done, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_study(TASK, CASES, tmp_path, done, report=stop)
    done.names.clear()
    run_study(TASK, CASES, tmp_path, done, resume=True)
    assert done.names == ["seed-2", "seed-3"]
