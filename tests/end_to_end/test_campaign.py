"""The loop closed by itself: a program measures, fails, hangs, is killed; the campaign goes on."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import pytest

from excite_cli import load_case
from tests.cli.program import Installed, Program
from tests.end_to_end.conftest import state_of, with_program

# Stands for a robot and whoever plays on it: notes what it played; MODE says what goes wrong.
PLAY = """
import os, shutil, sys, time
from pathlib import Path
import h5py
from excite_cli import load_case, simulate
from excite_cli.api.simulating import SimulationSettings

motion, log = map(Path, sys.argv[1:3])
mode = os.environ.get("MODE", "")
if mode == "fails":
    sys.exit("protective stop of joint elbow")
if mode == "hangs":
    time.sleep(60)
if mode == "another robot":
    log.write_text("t,q_left,q_right,tau_left,tau_right\\n" + "".join(
        f"{k / 100},{k / 50},0.5,1,2\\n" for k in range(800)))
    sys.exit()
if mode == "another motion":
    shutil.copy("other_log.h5", log)
    sys.exit()
with open("played.txt", "a") as file:
    print(motion.stem, file=file)
settings = SimulationSettings(rate=200.0, inertia_error=0.2, seed=4)
simulate(load_case("smoke.yaml"), motion, [EFFECTS], settings, output=log)
if mode == "no torques":
    with h5py.File(log, "a") as file:
        for run in file["runs"].values():
            del run["tau"]
"""
EFFECTS = ("spring@elbow=6", "coulomb_friction@shoulder_pitch=2")
LINE = f"'{sys.executable}' play.py {{motion}} {{data}}"
ASKED = (
    "campaign", "smoke.yaml", "--measure", LINE, "--log", ".h5", "--no-entry", "--max-rounds", "4",
    "--set", "optimizer.max_iterations=15", "--set", "optimizer.restarts=1",
    "--set", "diagnosis.kinds=[spring, coulomb_friction, viscous_friction]",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    effects = ", ".join(map(repr, EFFECTS))
    return with_program(tmp_path_factory.mktemp("campaigns"), PLAY.replace("EFFECTS", effects))


@pytest.fixture(scope="module")
def done(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, cache: Path
) -> tuple[Path, dict[str, Any]]:
    """A campaign that nothing disturbed: its folder, and its answer."""
    place = tmp_path_factory.mktemp("whole")
    shutil.copytree(folder, place, dirs_exist_ok=True)
    return place, Installed(place, cache).answer(*ASKED)


def test_it_ends_by_itself_with_a_model_that_can_be_used(
    done: tuple[Path, dict[str, Any]],
) -> None:
    place, answer = done
    assert answer["ended"] == "complete", answer["reason"]
    last = answer["rounds"][-1]["learned"]
    found = {"spring at the joint on elbow", "Coulomb friction on shoulder_pitch"}
    assert set(last["effects"]) == found
    assert last["after"] < 0.01 < last["before"]
    names = [motion["name"] for each in answer["rounds"] for motion in each["motions"]]
    assert (place / "played.txt").read_text().split() == names
    assert answer["rounds"][-1]["motions"][-1]["purpose"] == "explore"
    assert answer["seconds"] == pytest.approx(6.0 * len(names))
    declared = {each.kind for each in load_case(place / answer["model"]).spec.effects or ()}
    assert {"spring", "coulomb_friction"} <= declared
    page = Path(place / answer["page"]).read_text(encoding="utf-8")
    assert "spring at the joint on elbow" in page
    assert "Converged: " in page
    motion = place / "campaign" / "round_1_motion_1.csv"
    assert motion.read_text().startswith("t,q_shoulder_yaw,")


def test_killed_and_resumed_it_ends_the_same(
    done: tuple[Path, dict[str, Any]], folder: Path, tmp_path: Path, cache: Path
) -> None:
    """Nothing is measured twice, wherever it was killed; `EXCITE_KILLS`: how often, at least."""
    place, answer = done
    state = Path("campaign") / "campaign.json"
    began = (place / "campaign" / "round_1.h5").stat().st_mtime
    seconds = max((place / state).stat().st_mtime - began, 5.0)
    rng, killed, wanted = random.Random(7), 0, int(os.environ.get("EXCITE_KILLS", "3"))
    while killed < wanted:
        tries = tmp_path / f"after_{killed}_kills"
        shutil.copytree(folder, tries)
        excite = Installed(tries, cache)
        for _ in range(3):
            resume = ("--resume",) if (tries / state).exists() else ()
            process = excite.start(*ASKED, *resume)
            try:
                process.wait(rng.uniform(0.2, 0.6) * seconds)
            except subprocess.TimeoutExpired:
                os.kill(process.pid, signal.SIGKILL)
                process.wait()
                killed += 1
        again = excite.answer(*ASKED, "--resume")
        for key in ("ended", "reason", "rounds", "motions", "seconds"):
            assert again[key] == answer[key], key
        played = (tries / "played.txt").read_text().split()
        assert played == (place / "played.txt").read_text().split()


@pytest.fixture
def begun(done: tuple[Path, dict[str, Any]], folder: Path, tmp_path: Path, cache: Path) -> Program:
    """A campaign whose first motion is measured, and its second is not yet."""
    place, _ = done
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    shutil.copytree(place / "campaign", tmp_path / "campaign")
    state = tmp_path / "campaign" / "campaign.json"
    content = state_of(tmp_path)
    content["rounds"] = content["rounds"][:1]
    content["rounds"][0]["learned"] = None
    for motion in content["rounds"][0]["motions"][1:]:
        motion["data"] = ""
    content.update(ended="", reason="")
    state.write_text(json.dumps(content))
    for log in (tmp_path / "campaign").glob("round_*_log.h5"):
        if log.name != "round_1_motion_1_log.h5":
            log.unlink()
    shutil.copy(tmp_path / "campaign" / "round_1_motion_1_log.h5", tmp_path / "other_log.h5")
    return Program(tmp_path, cache)


@pytest.mark.parametrize(
    ("mode", "told"),
    [
        ("fails", "exit status 1. Its last line: protective stop of joint elbow."),
        ("hangs", "still running after 2 s (the motion takes 6 s) and was ended."),
        ("another robot", "round_1_motion_2_log.csv is no log of this robot: "),
        ("another motion", "round_1_motion_2_log.h5 is no log of round_1_motion_2: "),
        ("no torques", "has no dataset 'tau'"),
    ],
)
def test_what_goes_wrong_is_told_and_nothing_is_lost(
    begun: Program, monkeypatch: pytest.MonkeyPatch, mode: str, told: str
) -> None:
    monkeypatch.setenv("MODE", mode)
    more = ["--resume", "--retries", "0"]
    more += ["--timeout", "2"] if mode == "hangs" else []
    more += ["--log", ".csv"] if mode == "another robot" else []
    run = begun(*ASKED, *more)
    assert run.returncode == 1
    words = " ".join(run.stderr.split())
    assert told in words
    assert "Everything before it is kept: see to the cause, then go on with --resume." in words
    logs = [motion["data"] for motion in state_of(begun.folder)["rounds"][0]["motions"]]
    assert logs == ["round_1_motion_1_log.h5", "", ""]
    aside = list((begun.folder / "campaign").glob("*_rejected_1.*"))
    assert len(aside) == (mode not in ("fails", "hangs"))


def test_what_failed_once_is_tried_again(begun: Program) -> None:
    """The first try is a log of another motion, as if the robot had played the last one again."""
    play = begun.folder / "play.py"
    once = """\
if not os.path.exists("tried"):
    open("tried", "w").close()
    mode = "another motion"
"""
    text = play.read_text().replace('if mode == "fails"', once + 'if mode == "fails"', 1)
    play.write_text(text)
    run = begun(*ASKED, "--resume", "--max-rounds", "1", "--json")
    assert "is no log of round_1_motion_2" in run.stderr
    answer = json.loads(run.stdout)
    (first,) = answer["rounds"]
    assert [len(motion["rejected"]) for motion in first["motions"]] == [0, 1, 0]
    assert run.returncode == 1  # the budget of one round is spent
    assert answer["ended"] == "budget"
    assert "(--max-rounds) is spent" in answer["reason"]
    assert (begun.folder / "played.txt").read_text().split() == [
        "round_1_motion_2", "round_1_motion_3",
    ]  # fmt: skip


def test_another_config_or_robot_is_told(begun: Program) -> None:
    run = begun(*ASKED, "--resume", "--set", "trajectory.harmonics=5")
    assert run.returncode == 2
    assert "the config is not the one that the campaign in campaign began with" in run.stderr
    run = begun(*ASKED)
    assert run.returncode == 2
    assert "campaign holds a campaign already. Go on with --resume" in run.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((), "say who measures: --measure 'COMMAND {motion} {data}', --measure simulate, or"),
        (("--measure", "a {motion} {data}", "--inbox", "x"), "one of them."),
        (("--measure", "play.py {motion}"), "{data} is missing"),
        (("--inbox", "x", "--effect", "spring@elbow=1"), "belong to --measure simulate"),
    ],
)
def test_what_cannot_be_asked(
    folder: Path, cache: Path, arguments: tuple[str, ...], told: str
) -> None:
    run = Program(folder, cache)("campaign", "smoke.yaml", *arguments)
    assert run.returncode == 2
    assert told in " ".join(run.stderr.split())
    assert not (folder / "campaign").exists()


DRIVES = (
    "measurement={torque: command, command: {"
    "kp: {shoulder_yaw: 900, shoulder_pitch: 900, elbow: 400, wrist_roll: 20, slide: 900}, "
    "kd: {shoulder_yaw: 20, shoulder_pitch: 20, elbow: 8, wrist_roll: 0.2, slide: 20}}}"
)


def test_a_simulated_robot_has_the_drives_of_the_config(folder: Path, cache: Path) -> None:
    """No option: set points that lead the motions are sent, and an undeclared spring is named."""
    place = ("campaign", "smoke.yaml", "-o", "drives", "--measure", "simulate", *ASKED[6:])
    found = Installed(folder, cache)(
        *place, "--set", DRIVES, "--effect", EFFECTS[0], "--json", "--max-rounds", "1"
    )
    assert found.stdout, found.stderr
    answer = json.loads(found.stdout)
    assert "spring at the joint on elbow" in answer["rounds"][-1]["learned"]["effects"], (
        found.stderr
    )
    with h5py.File(next((folder / "drives").glob("*_log.h5"))) as file:
        drive = json.loads(file.attrs["truth"])["drive"]
        (run,) = file["runs"].values()
        assert set(run) == {"t", "q", "q_cmd"}
    assert drive["lead"] is True
    assert (drive["kp"]["elbow"], drive["kd"]["wrist_roll"]) == (400.0, 0.2)
    refused = Program(folder, cache)(
        *place[:3], "none", *place[4:], "--set", "measurement={torque: command}"
    )
    assert refused.returncode == 2
    assert "--measure simulate: it takes the gains of drives that follow" in refused.stderr
