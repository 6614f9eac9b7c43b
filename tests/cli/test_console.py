"""Tables that can be read and copied, completion, and the message of a bug."""

import json

import pytest
import typer.main

from excite_cli.api.showing import Answer, Table
from excite_cli.cli.app import app
from excite_cli.cli.completion import (
    complete_effect,
    complete_format,
    complete_key,
    complete_robot,
)
from excite_cli.cli.console import Terminal
from excite_cli.cli.exit_status import run_guarded
from excite_cli.cli.start_line import Best
from excite_cli.errors import FileError
from excite_cli.excitation.progress import Figure, Progress, ProgressMeasure, Stage
from excite_cli.export.exported import MODEL_FORMATS
from excite_cli.motion_formats.catalogue import MOTION_FORMATS
from excite_cli.robot.overview import known_robots

NAME = "a_very_long_name_of_a_joint_that_someone_wants_to_copy"


def printed(capsys: pytest.CaptureFixture[str], quiet: bool = False, as_json: bool = False) -> str:
    words = "so many words that they need more than one line of eighty columns"
    columns = ("joint", "figure", "words")
    made = Table("Title", columns, ((NAME, "1.5", words),), left=("joint",), words=("words",))
    Terminal(as_json, quiet).show(Answer((made, "a sentence [N·m]"), {"figure": float("inf")}))
    return capsys.readouterr().out


def test_off_a_terminal_rows_stay_whole(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    text = printed(capsys)
    assert f"\n{NAME}" in text
    assert "eighty columns\n" in text
    assert "\n\na sentence [N·m]\n" in text
    assert "\x1b" not in text
    assert all(line == line.rstrip() for line in text.splitlines())


def test_quiet_prints_the_answer_and_json_is_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert NAME in printed(capsys, quiet=True)
    assert json.loads(printed(capsys, quiet=True, as_json=True)) == {"figure": None}


def test_every_command_takes_the_flags_of_the_contract() -> None:
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        known = {option for param in command.params for option in param.opts}
        missing = {"--json", "--quiet", "--verbose", "--no-progress"} - known
        assert not missing, f"excite {name} lacks {missing}"


def test_completion_knows_robots_formats_kinds_and_keys() -> None:
    assert complete_format("r") == ["ros2", "rosbag2", "ros2-package", "randomization"]
    assert complete_format("") == [*MOTION_FORMATS.members, *MODEL_FORMATS]
    assert "ur10" in complete_robot("ur")
    assert complete_effect("spr") == ["spring@"]
    assert complete_key("optimizer.max_it") == ["optimizer.max_iterations="]
    assert complete_key("optim") == ["optimizer."]
    assert complete_key("nothing.at.all") == []


def test_robots_have_kinds() -> None:
    kinds = {each.name: each.kind for each in known_robots()}
    expected = {
        "ur10": "arm", "talos": "humanoid", "go1": "quadruped", "allegro_left_hand": "hand",
        "tiago": "mobile, with arms", "bolt": "biped", "baxter": "two arms", "iris": "flying",
    }  # fmt: skip
    assert expected.items() <= kinds.items()


def test_the_best_so_far_keeps_all_limits() -> None:
    best = Best()

    def words(
        value: float, margin: float, measure: ProgressMeasure = ProgressMeasure.CONDITION_NUMBER
    ) -> str:
        figure = Figure(measure, value)
        return best.words(Progress(1, figure, margin, 0.1, Stage(1, 3)))

    assert words(9.0, -0.1) == "condition number 9.00"
    assert words(12.0, 0.1) == "condition number 12.00 (best 12.00)"
    assert words(5.0, -0.1) == "condition number 5.00 (best 12.00)"
    assert words(3.0, 0.1, ProgressMeasure.DIVERGENCE) == "divergence 3"


def test_a_terminal_does_not_obey_names_of_files(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    name = "el\x1b[2J\x1b]0;title\x07bo\x9b1mw\x00"
    made = Table("Title", ("joint", "figure"), ((name, "1.5"),), left=("joint",))
    terminal = Terminal(verbose=True)
    terminal.show(Answer((made, f"of {name}")))
    terminal.say(name)
    terminal.detail(name)

    def fails() -> None:
        raise FileError(f"no joint {name}")

    run_guarded(fails)
    told = capsys.readouterr()
    seen = told.out + told.err
    assert seen.count("el[2J]0;titlebo1mw") == 5
    assert not [c for c in seen if (ord(c) < 0x20 or 0x7F <= ord(c) < 0xA0) and c != "\n"]
    Terminal(as_json=True).show(Answer((made,), {"joint": name}))
    assert json.loads(capsys.readouterr().out) == {"joint": name}


def test_a_bad_answer_is_exit_status_one(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit) as ended:
        Terminal().show(Answer(("broken",), {}, good=False))
    assert ended.value.exit_code == 1
    assert capsys.readouterr().out == "broken\n"


def test_rows_may_be_bold_and_set_apart(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    rows = (("first", "1"), ("second", "2"), ("mean", "1.5"))
    made = Table("", ("name", "figure"), rows, left=("name",), bold=(2,), parted=(2,))
    Terminal().show(Answer((made,)))
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2].strip() == ""
    assert lines[-1].split() == ["mean", "1.5"]
    assert "second" in lines[-3]
