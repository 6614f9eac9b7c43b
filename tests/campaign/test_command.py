"""A program that measures: its words, its end, and what is said of it."""

import json
import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path
from threading import Thread

import pytest

from excite_cli.campaign.command import Command
from excite_cli.campaign.measure import NotMeasuredError, Take
from excite_cli.errors import ConfigError
from tests.campaign.campaign_process import said, until

_BEGUN = 5.0  # s within which a program has begun, on a machine that is busy, too


def take_in(folder: Path) -> Take:
    motion = folder / "m 1.csv"
    motion.write_text("t\n0\n")
    return Take("m", motion, folder / "log of m.csv", 1.0, folder / "m.txt")


def program(folder: Path, body: str) -> str:
    (folder / "play.py").write_text("import sys, time, os, signal\n" + textwrap.dedent(body))
    return f"'{sys.executable}' '{folder / 'play.py'}' {{motion}} {{data}} {{name}}"


def test_it_gets_motion_log_and_name(tmp_path: Path) -> None:
    body = "open(sys.argv[2], 'w').write(open(sys.argv[1]).read() + sys.argv[3])"
    Command.of(program(tmp_path, body)).take(take_in(tmp_path))
    assert (tmp_path / "log of m.csv").read_text() == "t\n0\nm"


ODD = ["c{data}", "{motion}{name}", "-lead", 'it\'s $HOME `id` "x"', "a {} {0} %s \\1 \\g<0>"]


@pytest.mark.parametrize("folder", ODD)
def test_names_of_folders_reach_the_program_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    """Nothing in a name is a place to fill, for a shell, or an option."""
    body = "import json; json.dump(sys.argv[1:], open(sys.argv[2], 'w'))"
    command = Command.of(f"{program(tmp_path, body)} --log={{data}},{{name}}")
    monkeypatch.chdir(tmp_path)
    Path(folder).mkdir()
    command.take(take_in(Path(folder)))
    own = tmp_path / folder
    motion, log, name, both = json.loads((own / "log of m.csv").read_text())
    assert (motion, log, name) == (str(own / "m 1.csv"), str(own / "log of m.csv"), "m")
    assert both == f"--log={own / 'log of m.csv'},m"


def test_what_it_says_is_kept(tmp_path: Path) -> None:
    body = "print('connected'); print('oh', file=sys.stderr); sys.exit(3)"
    with pytest.raises(NotMeasuredError) as told:
        Command.of(program(tmp_path, body)).take(take_in(tmp_path))
    assert "exit status 3. Its last line: " in str(told.value)
    assert {"connected", "oh"} == set((tmp_path / "m.txt").read_text().split())


def test_no_log_is_told(tmp_path: Path) -> None:
    with pytest.raises(NotMeasuredError, match=r"wrote no .*log of m\.csv"):
        Command.of(program(tmp_path, "pass")).take(take_in(tmp_path))


def test_a_program_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(NotMeasuredError, match="'no-such-program' cannot be run: No such file"):
        Command.of("no-such-program {motion} {data}").take(take_in(tmp_path))


def test_one_that_hangs_is_told_to_stop_the_robot_and_ended(tmp_path: Path) -> None:
    body = """
        def stop(*_):
            print("stopped the robot", flush=True)
            sys.exit(0)
        signal.signal(signal.SIGTERM, stop)
        time.sleep(600)
    """
    with pytest.raises(NotMeasuredError, match=r"still running after 5 s .*stopped the robot"):
        Command.of(program(tmp_path, body), limit=_BEGUN).take(take_in(tmp_path))


def test_what_it_started_is_ended_too(tmp_path: Path) -> None:
    body = """
        import subprocess
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        print(child.pid, flush=True)
        time.sleep(600)
    """
    with pytest.raises(NotMeasuredError):
        Command.of(program(tmp_path, body), limit=_BEGUN).take(take_in(tmp_path))
    child = (tmp_path / "m.txt").read_text().strip()

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
        Command.of(text)
    assert told in str(error.value)


def test_a_suffix_has_its_dot() -> None:
    with pytest.raises(ConfigError, match="suffix with its dot"):
        Command.of("a {motion} {data}", "csv")


def test_a_program_of_a_killed_campaign_is_waited_for(tmp_path: Path) -> None:
    """The robot may still move: the lock lasts as long as the program, not as its campaign."""
    end = tmp_path / "end"
    body = f"""
        print("begun", flush=True)
        while not os.path.exists({str(end)!r}):
            time.sleep(0.02)
        open(sys.argv[2], "w").write("whole")
    """
    line = program(tmp_path, body)
    campaign = textwrap.dedent(
        f"""
        from pathlib import Path
        from excite_cli.campaign.command import Command
        from excite_cli.campaign.measure import Take
        folder = Path({str(tmp_path)!r})
        take = Take("m", folder / "m 1.csv", folder / "log of m.csv", 1.0, folder / "m.txt")
        Command.of({line!r}).take(take)
        """
    )
    take = take_in(tmp_path)
    process = subprocess.Popen([sys.executable, "-c", campaign])
    until(lambda: "begun" in said(tmp_path, "m.txt"), "the program has begun")
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    with pytest.raises(NotMeasuredError, match="still running"):
        Command.of(line, limit=0.2).wait_for_earlier(take)
    assert not take.data.exists()
    waiting = Thread(target=Command.of(line).wait_for_earlier, args=(take,))
    waiting.start()
    end.touch()
    waiting.join()
    assert take.data.read_text() == "whole"
