"""The cases of a study: their names, and requests that are the same only for the same question."""

import shutil
from pathlib import Path

import pytest

from excite_cli.api.studying import do_case
from excite_cli.errors import ConfigError, FileError
from excite_cli.study.case import StudyTask
from excite_cli.study.plan import VariedKey, combinations, parse_vary, planned_cases

ARM = Path(__file__).parents[2] / "data" / "smoke_arm.urdf"
SEEDS = [VariedKey("seed", ("1", "2"))]


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


def _names(task: StudyTask, logs: list[Path], *varied: str) -> list[str]:
    return [case.name for case in planned_cases(task, logs, list(map(parse_vary, varied)))]


@pytest.mark.parametrize("name", ["arm.urdf", "fit.h5", "log.csv"])
def test_other_contents_of_a_file_are_another_request(name: str, task: StudyTask) -> None:
    before = _requests(task)
    path = task.config.parent / name
    text = path.read_text()
    path.write_text(text.replace("2", "3").replace("fit", "tif"))  # of the same length
    assert not set(before) & set(_requests(task))
    path.write_text(text)  # another time of change
    assert _requests(task) == before
    other = StudyTask(task.config, ("trajectory.harmonics=2",))
    assert not set(before) & set(_requests(other))


def test_a_case_whose_config_was_changed_meanwhile_fails(task: StudyTask) -> None:
    first, _ = planned_cases(task, [], SEEDS)
    task.config.write_text("robot: {urdf: arm.urdf}\nuncertainty: {sigmas: 2.0}\n")
    with pytest.raises(FileError, match="was changed while the study ran"):
        do_case(task, first, lambda word: None)


@pytest.mark.parametrize(
    ("logs", "vary", "said"),
    [
        ([], ["seed=1,2,0x1"], r"seed=1 and seed=0x1 ask for the same"),
        ([], ["seeds=1,2"], "Did you mean 'seed'"),
        ([], ["trajectory.harmonics=4,-1"], r"trajectory\.harmonics"),
        ([], [], "something to vary"),
        ([Path("nothing.h5")], [], "There is no file"),
    ],
)
def test_everything_is_checked_before_the_work(
    logs: list[Path], vary: list[str], said: str, task: StudyTask
) -> None:
    with pytest.raises((ConfigError, FileError), match=said):
        _names(task, logs, *vary)


def test_names_say_what_is_varied_and_are_names_of_files(task: StudyTask) -> None:
    assert _names(task, [], "constraints.torque={scale: 0.5},null", "seed=1,2") == [
        "torque=scale-0.5_seed=1",
        "torque=scale-0.5_seed=2",
        "torque=null_seed=1",
        "torque=null_seed=2",
    ]
    varied = ("optimizer.tolerance=1e-3,0.01", "seed=3")
    assert _names(task, [], *varied)[0] == "tolerance=1e-3_seed=3"
    folder = task.config.parent
    same = [folder / "run.h5", folder / "other" / "run.h5"]
    long = [folder / f"{'測' * 80}{end}.csv" for end in "ab"]  # cut by the bytes that they take
    (folder / "other").mkdir()
    for log in (*same, *long):
        log.write_text(str(log))
    names = _names(task, same)
    assert len(set(names)) == 2
    assert all(name.startswith("run_") for name in names)
    names = _names(task, long)
    assert len(set(names)) == 2
    for name in names:
        (folder / f".{name}.diagnosis.h5.abcdefgh.part").write_text("")


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("seed=1..4", ("1", "2", "3", "4")),
        ("seed=7, 9..10", ("7", "9", "10")),
        ("constraints.torque=null,{scale: 0.5}", ("null", "{scale: 0.5}")),
        ("robot.joints=[a, b],[c]", ("[a, b]", "[c]")),
        ("robot.urdf='a,b.urdf',c.urdf", ("'a,b.urdf'", "c.urdf")),
    ],
)  # fmt: skip
def test_values(text: str, values: tuple[str, ...]) -> None:
    assert parse_vary(text) == VariedKey(text.partition("=")[0], values)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("seed", "write key.path=VALUE"),
        ("=1,2", "write key.path=VALUE"),
        ("seed=1,,2", "a value is missing"),
        ("seed=", "a value is missing"),
        ("seed=1..3,2", "2 is given twice"),
        ("seed=4..1", "must go upwards"),
        ("seed=1..999999999", "must go upwards, over at most"),
    ],
)
def test_what_cannot_be_read_is_said(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parse_vary(text)


def test_all_combinations_the_last_key_fastest() -> None:
    both = combinations([VariedKey("a", ("1", "2")), VariedKey("b", ("x", "y"))])
    assert [tuple(each.values()) for each in both] == [
        ("1", "x"), ("1", "y"), ("2", "x"), ("2", "y"),
    ]  # fmt: skip
    assert combinations([]) == [{}]
    with pytest.raises(ConfigError, match="given twice"):
        combinations([VariedKey("a", ("1",)), VariedKey("a", ("2",))])
    long = tuple(map(str, range(1000)))
    with pytest.raises(ConfigError, match="1000000 combinations"):
        combinations([VariedKey("a", long), VariedKey("b", long)])
