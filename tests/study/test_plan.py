"""What a case asks for: the same request only for the same settings and the same files."""

import shutil
from pathlib import Path

import pytest

from excite_cli.api.studying import do_case
from excite_cli.errors import ConfigError, FileError
from excite_cli.study.case import StudyTask
from excite_cli.study.plan import planned_cases
from excite_cli.study.vary import Varied

ARM = Path(__file__).parents[2] / "data" / "smoke_arm.urdf"
SEEDS = [Varied("seed", ("1", "2"))]


@pytest.fixture
def task(tmp_path: Path) -> StudyTask:
    shutil.copy(ARM, tmp_path / "arm.urdf")
    (tmp_path / "fit.h5").write_text("a fit")
    (tmp_path / "log.csv").write_text("1,2")
    config = tmp_path / "arm.yaml"
    config.write_text("robot: {urdf: arm.urdf}\nuncertainty: {fit: fit.h5}\n")
    return StudyTask(config, ())


def _requests(task: StudyTask) -> list[str]:
    log = task.config.parent / "log.csv"
    return [case.request for case in planned_cases(task, [log], SEEDS)]


@pytest.mark.parametrize("name", ["arm.urdf", "fit.h5", "log.csv"])
def test_other_contents_of_a_file_are_another_request(name: str, task: StudyTask) -> None:
    before = _requests(task)
    path = task.config.parent / name
    text = path.read_text()
    path.write_text(text.replace("2", "3").replace("fit", "tif"))  # of the same length
    after = _requests(task)
    assert not set(before) & set(after)
    path.write_text(text)  # another time of change
    assert _requests(task) == before


def test_a_case_whose_config_was_changed_meanwhile_fails(task: StudyTask) -> None:
    first, _ = planned_cases(task, [], SEEDS)
    task.config.write_text("robot: {urdf: arm.urdf}\nuncertainty: {sigmas: 2.0}\n")
    with pytest.raises(FileError, match="was changed while the study ran"):
        do_case(task, first, lambda word: None)


def test_the_same_asked_in_two_ways_is_refused(task: StudyTask) -> None:
    with pytest.raises(ConfigError, match=r"seed=1 and seed=0x1 ask for the same"):
        planned_cases(task, [], [Varied("seed", ("1", "2", "0x1"))])


def test_names_are_cut_by_the_bytes_that_they_take(task: StudyTask) -> None:
    logs = [task.config.parent / f"{'測' * 80}{end}.csv" for end in "ab"]
    for log in logs:
        log.write_text(log.stem)
    names = [case.name for case in planned_cases(task, logs, [])]
    assert len(set(names)) == 2
    for name in names:
        (task.config.parent / f".{name}.diagnosis.h5.abcdefgh.part").write_text("")
