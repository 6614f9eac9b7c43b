"""A motion of a campaign counts as measured once what measured it has ended well, and only then."""

import shutil
import signal
import sys
import time
from pathlib import Path
from threading import Thread

import h5py
import pytest

from excite_cli import load_case, run_campaign, simulate
from excite_cli.api.campaigning import CampaignOptions, Inbox
from excite_cli.api.simulating import SimulationSettings
from excite_cli.campaign import inbox, measure_command
from excite_cli.campaign.same_motion import record_measured
from excite_cli.campaign.supervisor import ProgramExit
from excite_cli.shown.note import Level, Note
from tests.campaign.campaign_process import PATIENCE, until
from tests.cli.program import Program
from tests.end_to_end.conftest import state_of, with_program

# Plays by copying a log; notes what it played. Its first take is long, and ends in a failure.
PLAY = """
import os, shutil, sys, time
motion, log = sys.argv[1:3]
name = os.path.basename(motion)
first = not os.path.exists("played.txt")
with open("played.txt", "a") as file:
    print(name, file=file)
shutil.copy("good.h5", log)
if first:
    time.sleep(2.0)
    sys.exit("protective stop of joint elbow")
sys.exit(0 if "1_motion_1" in name else "enough")
"""
OVERRIDES = ("optimizer.max_iterations=3", "optimizer.restarts=1")
ASKED = (
    "campaign", "smoke.yaml", "--no-entry", "--plain", "--retries", "0", "--log", ".h5",
    *(word for each in OVERRIDES for word in ("--set", each)),
)  # fmt: skip
LINE = ("--measure", f"'{sys.executable}' play.py {{motion}} {{data}}")


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Path:
    """A folder with a campaign whose first motion is planned, and a good log of it."""
    folder = with_program(tmp_path_factory.mktemp("planned"), PLAY)
    run = Program(folder, cache)(*ASKED, "--measure", "false {motion} {data}")
    assert "was not measured in 1 tries" in run.stderr, run.stderr
    played(folder / "campaign" / "round_1_motion_1.csv", folder / "good.h5")
    return folder


def played(motion: Path, log: Path) -> None:
    """A log of the motion."""
    settings = SimulationSettings(rate=200.0, inertia_error=0.2, seed=4)
    simulate(load_case(motion.parents[1] / "smoke.yaml"), motion, (), settings, output=log)


@pytest.fixture
def begun(planned: Path, tmp_path: Path, cache: Path) -> Program:
    shutil.copytree(planned, tmp_path, dirs_exist_ok=True)
    return Program(tmp_path, cache)


def names(folder: Path) -> list[str]:
    return (folder / "played.txt").read_text().split()


def test_a_log_whose_program_has_failed_is_no_log_after_a_kill_either(begun: Program) -> None:
    """The campaign is killed; its program writes a log, stops the robot and says that it failed."""
    log = begun.folder / "campaign" / "round_1_motion_1_log.h5"
    campaign = begun.start(*ASKED, *LINE, "--resume")
    until(log.exists, "the program has written a log")
    campaign.send_signal(signal.SIGKILL)
    campaign.communicate()
    run = begun(*ASKED, *LINE, "--resume")
    assert "round_1_motion_1_log.h5 may be half a log: no record says that" in run.stderr
    assert log.with_name("round_1_motion_1_log_rejected_1.h5").exists()
    assert names(begun.folder) == [
        "round_1_motion_1.csv", "round_1_motion_1.csv", "round_1_motion_2.csv",
    ]  # fmt: skip
    (rejected,) = state_of(begun.folder)["rounds"][0]["motions"][0]["rejected"]
    assert "may be half a log" in rejected


@pytest.mark.parametrize("changed", [False, True])
def test_what_is_recorded_is_about_that_log(begun: Program, changed: bool) -> None:
    (begun.folder / "played.txt").write_text("")
    log = begun.folder / "campaign" / "round_1_motion_1_log.h5"
    shutil.copy(begun.folder / "good.h5", log)
    record_measured(log)
    if changed:
        with h5py.File(log, "a") as file:
            file.attrs["changed"] = "since"
    run = begun(*ASKED, *LINE, "--resume")
    assert ("may be half a log" in run.stderr) == changed
    assert names(begun.folder) == ["round_1_motion_1.csv"] * changed + ["round_1_motion_2.csv"]


def test_nothing_is_played_while_something_may_still_move_the_robot(
    begun: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = []

    def not_ended(*given: object) -> ProgramExit:
        tries.append(given)
        return ProgramExit(None, "limit", alive="process 4711 (python)")

    monkeypatch.setattr(measure_command, "followed", not_ended)
    run = begun(*ASKED, *LINE, "--resume", "--retries", "5")
    assert run.returncode == 1
    assert len(tries) == 1
    last = run.stderr.strip().splitlines()[-1]
    assert last.startswith(
        "error: still running: process 4711 (python), of the measuring program. The robot may "
        "move: stop it by hand"
    )


def test_an_inbox_takes_whole_logs_of_its_motion_and_of_today(
    begun: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inbox, "_STILL", 0.3)
    box, said, notes = begun.folder / "box", list[str](), list[Note]()
    case = load_case(begun.folder / "smoke.yaml", OVERRIDES)
    asked = CampaignOptions(entry=False, plain=True, most_rounds=1)
    campaign = Thread(
        target=run_campaign,
        args=(case, Inbox(box, said.append, ".h5"), begun.folder / "campaign", asked),
        kwargs={"resume": True, "tell": notes.append},
        daemon=True,
    )
    campaign.start()

    def hear(*words: str) -> None:
        until(lambda: said and all(each in said[-1] for each in words), f"it says {words}: {said}")

    good = begun.folder / "good.h5"
    hear("play ", "round_1_motion_1.csv")
    first = box / "round_1_motion_1_log.h5"
    first.write_bytes(good.read_bytes()[:-20_000])  # a copy on its way
    hear("round_1_motion_1_log.h5 is not taken: round_1_motion_1_log.h5 is no log of this robot")
    shutil.copy(good, first)
    with h5py.File(first, "a") as file:
        for run in file["runs"].values():
            run.attrs["epoch"] = time.time() - 30 * 86400.0
    hear("its time stamps end ", "s before the motion was written", "touch ", ".ok")
    shutil.copy(good, first)
    hear("play ", "round_1_motion_2.csv")
    second = box / "round_1_motion_2_log.h5"
    shutil.copy(good, second)
    hear("is a copy of round_1_motion_1_log.h5, byte for byte")
    played(begun.folder / "campaign" / "round_1_motion_2.csv", begun.folder / "second.h5")
    shutil.copy(begun.folder / "second.h5", second)
    hear("play ", "round_1_motion_3.csv")
    played(begun.folder / "campaign" / "round_1_motion_3.csv", box / "round_1_motion_3_log.h5")
    campaign.join(PATIENCE)
    steps = [each.where for each in notes if each.level is Level.STEP]
    for what in ("round_1_motion_1, measuring (a motion of", "round_1_motion_3, checking the log"):
        assert any(each.startswith(what) for each in steps), steps
    assert steps.index("round 1: diagnosing 3 logs") > steps.index(what)
    assert not campaign.is_alive()
    motions = state_of(begun.folder)["rounds"][0]["motions"]
    assert [motion["data"] for motion in motions] == [
        f"round_1_motion_{k}_log.h5" for k in (1, 2, 3)
    ]
    assert [motion["rejected"] for motion in motions] == [[], [], []]
    assert (begun.folder / "campaign" / "round_1_motion_1_log.h5").read_bytes() == good.read_bytes()
