"""What --vary says, and the cases that come of it."""

from pathlib import Path

import pytest

from excite_cli.errors import ConfigError, FileError
from excite_cli.study.case import StudyTask
from excite_cli.study.plan import planned_cases
from excite_cli.study.vary import Varied, combinations, parse_vary

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"
TASK = StudyTask(SMOKE, ())


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
    assert parse_vary(text) == Varied(text.partition("=")[0], values)


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
    both = combinations([Varied("a", ("1", "2")), Varied("b", ("x", "y"))])
    assert [tuple(each.values()) for each in both] == [
        ("1", "x"), ("1", "y"), ("2", "x"), ("2", "y"),
    ]  # fmt: skip
    assert combinations([]) == [{}]
    with pytest.raises(ConfigError, match="given twice"):
        combinations([Varied("a", ("1",)), Varied("a", ("2",))])
    long = tuple(map(str, range(1000)))
    with pytest.raises(ConfigError, match="1000000 combinations"):
        combinations([Varied("a", long), Varied("b", long)])


def test_names_say_what_is_varied_and_are_names_of_files(tmp_path: Path) -> None:
    varied = [parse_vary("constraints.torque={scale: 0.5},null"), parse_vary("seed=1,2")]
    names = [case.name for case in planned_cases(TASK, [], varied)]
    assert names == [
        "torque=scale-0.5_seed=1", "torque=scale-0.5_seed=2", "torque=null_seed=1",
        "torque=null_seed=2",
    ]  # fmt: skip
    varied = [parse_vary("optimizer.tolerance=1e-3,0.01"), parse_vary("seed=3")]
    assert planned_cases(TASK, [], varied)[0].name == "tolerance=1e-3_seed=3"
    logs = [tmp_path / "run.h5", tmp_path / "other" / "run.h5"]
    for log in logs:
        log.parent.mkdir(exist_ok=True)
        log.write_bytes(b"")
    same = [case.name for case in planned_cases(TASK, logs, [])]
    assert len(set(same)) == 2
    assert all(name.startswith("run_") for name in same)


def test_everything_is_checked_before_the_work() -> None:
    with pytest.raises(ConfigError, match="Did you mean 'seed'"):
        planned_cases(TASK, [], [parse_vary("seeds=1,2")])
    with pytest.raises(ConfigError, match=r"trajectory\.harmonics"):
        planned_cases(TASK, [], [parse_vary("trajectory.harmonics=4,-1")])
    with pytest.raises(ConfigError, match="something to vary"):
        planned_cases(TASK, [], [])
    with pytest.raises(FileError, match="There is no file"):
        planned_cases(TASK, [Path("nothing.h5")], [])


def test_a_request_is_all_that_is_asked(tmp_path: Path) -> None:
    log = tmp_path / "run.h5"
    log.write_bytes(b"one")
    first = planned_cases(TASK, [log], [])[0].request
    assert planned_cases(TASK, [log], [])[0].request == first
    log.write_bytes(b"longer")
    assert planned_cases(TASK, [log], [])[0].request != first
    other = StudyTask(SMOKE, ("seed=5",))
    assert planned_cases(other, [log], [])[0].request != first
