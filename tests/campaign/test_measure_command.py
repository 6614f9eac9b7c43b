"""A program that measures: its words, its end, and what is said of it."""

import json
import subprocess
from pathlib import Path

import pytest

from excite_cli.campaign.measure import NotMeasuredError
from excite_cli.campaign.measure_command import MeasureCommand
from excite_cli.errors import ConfigError
from tests.campaign.campaign_process import program, said, take_in, until

_BEGUN = 5.0  # s within which a program has begun, on a machine that is busy, too


ODD = ["plain", "c{data}", "{motion}{name}", "-lead", 'it\'s $HOME `id` "x"', "a {} %s \\1 \\g<0>"]


@pytest.mark.long
@pytest.mark.parametrize("folder", ODD)
def test_it_gets_motion_log_and_name_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    """Nothing in a name is a place to fill, for a shell, or an option."""
    body = "import json; json.dump(sys.argv[1:], open(sys.argv[2], 'w'))"
    command = MeasureCommand.of(f"{program(tmp_path, body)} --log={{data}},{{name}}")
    monkeypatch.chdir(tmp_path)
    Path(folder).mkdir()
    command.take(take_in(Path(folder)))
    own = tmp_path / folder
    log = str(own / "log of m.csv")
    assert json.loads(Path(log).read_text()) == [str(own / "m 1.csv"), log, "m", f"--log={log},m"]


def test_what_it_says_is_kept(tmp_path: Path) -> None:
    body = "print('connected'); print('oh', file=sys.stderr); sys.exit(3)"
    with pytest.raises(NotMeasuredError) as told:
        MeasureCommand.of(program(tmp_path, body)).take(take_in(tmp_path))
    assert "exit status 3. Its last line: " in str(told.value)
    assert {"connected", "oh"} == set((tmp_path / "m.txt").read_text().split())


@pytest.mark.long
def test_no_log_and_no_program_are_told(tmp_path: Path) -> None:
    with pytest.raises(NotMeasuredError, match=r"wrote no .*log of m\.csv"):
        MeasureCommand.of(program(tmp_path, "pass")).take(take_in(tmp_path))
    with pytest.raises(NotMeasuredError, match="'no-such-program' cannot be run: No such file"):
        MeasureCommand.of("no-such-program {motion} {data}").take(take_in(tmp_path))


@pytest.mark.long
def test_one_that_hangs_is_told_to_stop_the_robot_and_ended_with_what_it_started(
    tmp_path: Path,
) -> None:
    body = """
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        def stop(*_):
            print(child.pid, "stopped the robot", flush=True)
            sys.exit(0)
        signal.signal(signal.SIGTERM, stop)
        time.sleep(600)
    """
    with pytest.raises(NotMeasuredError, match=r"still running after 5 s .*stopped the robot"):
        MeasureCommand.of(program(tmp_path, body), limit=_BEGUN).take(take_in(tmp_path))
    child = said(tmp_path, "m.txt").split()[0]

    def state() -> str:
        ps = subprocess.run(["ps", "-o", "stat=", "-p", child], capture_output=True, text=True)
        return ps.stdout.strip()[:1]

    until(lambda: state() in ("", "Z"), "the child has ended")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("play.py {motion}", "{data} is missing"),
        ("play.py", "{motion} and {data} is missing"),
        ("play.py '{motion} {data}", "No closing quotation"),
    ],
)
def test_lines_that_cannot_be(text: str, told: str) -> None:
    with pytest.raises(ConfigError) as error:
        MeasureCommand.of(text)
    assert told in str(error.value)
    with pytest.raises(ConfigError, match="suffix with its dot"):
        MeasureCommand.of("a {motion} {data}", "csv")
