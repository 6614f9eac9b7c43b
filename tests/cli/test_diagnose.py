"""`excite diagnose` as a user runs it, on simulated data of the smoke arm."""

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import pytest
import yaml

from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import load_case
from excite_cli.config.load_spec import load_spec
from excite_cli.store.diagnosis_file import read_diagnosis
from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

pytest.importorskip("mujoco")

JOINTS = ["shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide"]
KINDS = "[viscous_friction,coulomb_friction,torque_offset,spring,armature]"
QUICK = ("--set", f"diagnosis.kinds={KINDS}")
PLANTED = {("coulomb_friction", "elbow"), ("viscous_friction", "shoulder_pitch")}
BY_JOINT = {"relative", "relative_moving", "rms", "rms_raw", "rms_moving", "samples"}


@dataclass(frozen=True)
class Outcome:
    """What one diagnosis printed and wrote."""

    answer: dict[str, Any]
    data: Path
    file: Path
    better: Path


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory, cache: Path, two_motions: Run) -> Path:
    """Four runs of an arm with more friction than the config says."""
    folder = tmp_path_factory.mktemp("diagnose_data")
    path = folder / "data.h5"
    effects = (
        "--effect", "coulomb_friction@elbow=2", "--effect", "viscous_friction@shoulder_pitch=3",
    )  # fmt: skip
    arguments = ("-o", path, "--rate", "200", "--repeat", "2", *effects)
    Program(folder, cache).answer("simulate", SMOKE, two_motions.path, *arguments)
    return path


@pytest.fixture(scope="session")
def outcome(tmp_path_factory: pytest.TempPathFactory, cache: Path, data: Path) -> Outcome:
    folder = tmp_path_factory.mktemp("diagnose")
    file, better = folder / "found.h5", folder / "new" / "better.yaml"
    better.parent.mkdir()
    answer = Program(folder, cache).answer(
        "diagnose", SMOKE, data, *QUICK, "-o", file, "--apply", better
    )
    return Outcome(answer, data, file, better)


def named(answer: dict[str, Any]) -> set[tuple[str, str]]:
    return {(each["kind"], each["joints"][0]) for each in answer["effects"]}


def test_json_is_as_promised(outcome: Outcome) -> None:
    answer = outcome.answer
    assert "next_experiment" in answer
    for effect in answer["effects"]:
        assert effect["verdict"] == "confirmed"
        joint = effect["joints"][0]
        assert set(effect["removes"][joint]) == {"relative", "relative_moving", "rms"}
        assert effect["removes"][joint]["rms"] > 0.1
        assert all(set(p) == {"value", "std", "unit"} for p in effect["parameters"].values())
        assert 0 <= effect["p_value"] <= 0.01
        assert 0 < effect["share_of_residual"] < 1.05  # other rows are fitted at its cost
        assert all({"kind", "joints"} <= set(alias) for alias in effect["alias_set"])
        assert effect["runs"]
    assert all({"kind", "joints"} <= set(each) and each["by"] for each in answer["absorbed"])
    for each in answer["unexplained"]:
        assert set(each) >= {"joint", "depends_on", "share_of_residual"}
    error = answer["error"]
    assert error["held_out_run"] == "motion_2_take_2"
    assert error["samples"] == error["after"]["samples"]
    for when in ("before", "after", "untouched"):
        assert set(error[when]) >= {"mean_relative", "mean_relative_moving", *BY_JOINT}
        assert all(list(error[when][name]) == JOINTS for name in BY_JOINT)


def test_parts_add_up_to_the_fall_of_the_error(outcome: Outcome) -> None:
    answer, error = outcome.answer, outcome.answer["error"]
    assert (error["baseline"], error["inertias_error_reduction"]) == ("before", {})
    for joint in JOINTS:
        parts = sum(each["error_reduction"][joint] for each in answer["effects"])
        before, after = (error[when]["relative_moving"][joint] for when in ("before", "after"))
        assert parts == pytest.approx(before - after, abs=1e-9)
    (elbow,) = (each for each in answer["effects"] if each["joints"] == ["elbow"])
    fallen = elbow["error_reduction"]
    assert max(fallen, key=lambda joint: fallen[joint]) == "elbow"
    assert answer["shares"] == {"friction": pytest.approx(1.0)}
    said = "Friction accounts for nearly all of the error reduction, largest on "
    assert answer["answer"].startswith(said)


def test_what_was_planted_is_found_with_its_size(outcome: Outcome) -> None:
    """As an effect, in the numbers of the model, and as the line of a data sheet."""
    answer, coulomb, viscous = outcome.answer, *(pytest.approx(x, rel=0.05) for x in (2.0, 3.0))
    assert named(answer) == PLANTED
    sizes = {each["kind"]: next(iter(each["parameters"].values())) for each in answer["effects"]}
    assert sizes["coulomb_friction"]["value"] == coulomb
    assert sizes["coulomb_friction"]["unit"] == "N·m"
    assert sizes["viscous_friction"]["value"] == viscous
    error = answer["error"]
    for joint in ("elbow", "shoulder_pitch"):
        assert error["after"]["rms"][joint] < 0.5 * error["before"]["rms"][joint]
    lines = {each["joint"]: each for each in answer["friction_lines"]}
    assert set(lines) == {"elbow", "shoulder_pitch"}
    assert lines["elbow"]["coulomb"]["value"] == coulomb
    assert lines["shoulder_pitch"]["viscous"]["value"] == viscous
    model = answer["model"]
    assert len(model["inertias"]) == 10 * len(JOINTS)
    assert {"m[elbow]", "Izz[slide]"} <= set(model["inertias"])
    values = {(each["kind"], *each["joints"]): each["values"] for each in model["effects"]}
    assert set(values) == PLANTED
    assert values["coulomb_friction", "elbow"] == [coulomb]


def test_the_file_holds_the_same_diagnosis(outcome: Outcome) -> None:
    found, answer = read_diagnosis(outcome.file), outcome.answer
    assert {(e.effect.kind, e.effect.joints[0]) for e in found.effects} == named(answer)
    for record, told in zip(found.effects, answer["effects"], strict=True):
        assert record.p_value == told["p_value"]
        for name, value in record.parameters.items():
            assert value.value == told["parameters"][name]["value"]
    assert found.after.mean_relative == answer["error"]["after"]["mean_relative"]
    assert found.held_out_run == answer["error"]["held_out_run"]
    assert "smoke_arm.urdf" in found.config
    assert found.versions
    assert answer["output"] == {"diagnosis": str(outcome.file), "config": str(outcome.better)}


@pytest.mark.long
def test_the_new_config_needs_nothing_more(outcome: Outcome, excite: Program) -> None:
    spec = load_spec(outcome.better)
    assert spec.effects is not None
    declared = {(e.kind, joint) for e in spec.effects for joint in e.joints}
    assert declared == PLANTED
    tree = yaml.safe_load(outcome.better.read_text())
    assert tree["trajectory"] == yaml.safe_load(SMOKE.read_text())["trajectory"]
    again = excite.answer("diagnose", outcome.better, outcome.data)
    assert again["effects"] == []
    assert {(e["kind"], e["joints"][0]) for e in again["declared_effects"]} == PLANTED
    after = outcome.answer["error"]["after"]["mean_relative"]
    assert again["error"]["before"]["mean_relative"] == pytest.approx(after, rel=1e-3)
    assert again["error"]["after"] == again["error"]["before"]


@pytest.mark.long
def test_people_get_tables(outcome: Outcome, excite: Program) -> None:
    run = excite.good("diagnose", SMOKE, outcome.data, *QUICK, "--held-out", "motion_1_take_1")
    for words in (
        "What the declared model lacks", "Coulomb friction", "N·m",
        "Error of the torque on held-out data (motion_1_take_1)", "Next: keep it in a file",
    ):  # fmt: skip
        assert words in run.stdout
    assert list(excite.folder.iterdir()) == []  # nothing is written unasked


@pytest.mark.long
def test_overwrite_replaces(outcome: Outcome, excite: Program) -> None:
    path = excite.folder / "found.h5"
    path.write_text("old")
    run = excite.good("diagnose", SMOKE, outcome.data, *QUICK, "-o", path, "--overwrite", "-q")
    assert run.stderr == ""
    assert "plan a motion, to " in run.stdout
    assert {e.effect.kind for e in read_diagnosis(path).effects} == {kind for kind, _ in PLANTED}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--held-out", "motion_9"), "there is no run 'motion_9'"),
        (("--set", "diagnosis.kinds=[stiction]"), "there is no effect 'stiction'"),
        (("--set", "measurement.filter.position=150"), "beyond half the recorded rate"),
        (("-o", "x", "--apply", "./x"), "--output and --apply"),
        (("-o", "."), "is a folder"),
        (
            ("-o", "there"),
            "exists already. Give another name, or replace it with --overwrite",
        ),
        (("--apply", "there"), "there exists already"),
        (("--apply-unconfirmed",), "--apply-unconfirmed says nothing without --apply"),
    ],
)
def test_bad_requests_get_one_message(
    outcome: Outcome, excite: Program, arguments: tuple[str, ...], words: str
) -> None:
    (excite.folder / "there").write_text("mine")
    assert words in excite.refused("diagnose", SMOKE, outcome.data, *arguments)
    assert [path.read_text() for path in excite.folder.iterdir()] == ["mine"]


@pytest.fixture(scope="session")
def mended(
    tmp_path_factory: pytest.TempPathFactory, cache: Path, data: Path, two_motions: Run
) -> Path:
    """The friction is gone when the last run is recorded, which will be held out."""
    folder = tmp_path_factory.mktemp("mended")
    path = folder / "data.h5"
    later = folder / "later.h5"
    Program(folder, cache).answer(
        "simulate", SMOKE, two_motions.path, "-o", later, "--rate", "200", "--seed", "2"
    )
    shutil.copy(data, path)
    with h5py.File(path, "a") as file, h5py.File(later) as new:
        del file["runs/motion_2_take_2"]
        new.copy("runs/motion_2", file, "runs/motion_2_take_2")
    return path


@pytest.mark.long
def test_a_held_out_error_that_does_not_fall_is_a_bad_answer(mended: Path, excite: Program) -> None:
    """Exit status 1, said first, and nothing is written unasked."""
    better = excite.folder / "better.yaml"
    run = excite("diagnose", SMOKE, mended, *QUICK, "--apply", better, "-o", "found.h5", "--json")
    assert run.returncode == 1, run.stderr
    answer = json.loads(run.stdout)
    assert (next(iter(answer)), answer["good"]) == ("good", False)
    error = answer["error"]
    assert error["after"]["mean_relative"] > error["before"]["mean_relative"]
    assert "The held-out error did not fall" in answer["reason"]
    harmful = {each["kind"] for each in answer["effects"] if each["verdict"] == "harmful"}
    assert "coulomb_friction" in harmful
    assert answer["output"] == {"diagnosis": "found.h5"}
    assert not better.exists()
    assert f"{better} is not written" in run.stderr
    assert "--apply-unconfirmed" in run.stderr


@pytest.mark.long
def test_what_is_not_confirmed_is_written_where_that_is_asked_for(
    mended: Path, excite: Program
) -> None:
    better = excite.folder / "better.yaml"
    run = excite("diagnose", SMOKE, mended, *QUICK, "--apply", better, "--apply-unconfirmed")
    assert run.returncode == 1, run.stderr
    assert run.stdout.startswith("The held-out error did not fall: ")
    spec = load_spec(better)
    assert spec.effects is not None
    assert ("coulomb_friction", "elbow") in {(e.kind, e.joints[0]) for e in spec.effects}


@pytest.mark.parametrize("command", ["diagnose", "identify"])
def test_copies_of_training_data_are_refused_as_held_out(
    data: Path, excite: Program, command: str
) -> None:
    copy = excite.folder / "copy.h5"
    shutil.copy(data, copy)
    told = excite.refused(command, SMOKE, data, copy)
    assert "hold the same samples to the last digit" in told
    assert "motion_2_take_2" in told
    assert str(copy) in told
    link = excite.folder / "link.h5"
    link.symlink_to(data)
    assert "is given twice" in excite.refused(command, SMOKE, data, link)


@pytest.mark.long
def test_a_joint_without_torque_is_left_out_and_the_others_are_found(
    data: Path, excite: Program, outcome: Outcome
) -> None:
    """Its torque is worthless and its motion counts; nothing is said of it but that."""
    path = excite.folder / "worthless.h5"
    shutil.copy(data, path)
    with h5py.File(path, "r+") as file:
        for run in file["runs"].values():
            run["tau"][:, 3] = 0.0
    assert "measurement.without_torque" in excite.refused("diagnose", SMOKE, path, *QUICK)
    without = ("--set", "measurement.without_torque=[wrist_roll]")
    answer = excite.answer("diagnose", SMOKE, path, *QUICK, *without, "-o", "found.h5")
    assert named(answer) == PLANTED
    after = answer["error"]["after"]
    assert after["relative"]["wrist_roll"] is None
    assert after["relative_moving"].pop("wrist_roll") is None
    # At rest, dry friction is whatever holds the joint; how long the elbow rests depends on the
    # motion, which is planned anew on every machine: so by the same runs with all torques.
    whole = outcome.answer["error"]["after"]
    for measure in ("relative", "relative_moving"):
        for joint in after["relative_moving"]:
            assert after[measure][joint] < 1.1 * whole[measure][joint], (measure, joint)
    assert after["mean_relative_moving"] < 0.02
    page = excite.folder / "page.html"
    excite.good("report", "found.h5", "-o", page)
    assert not re.search(r"\bnan\b", page.read_text(encoding="utf-8"))
    fitted = excite.answer("identify", SMOKE, path, *without)
    assert fitted["error"]["rms_raw"]["wrist_roll"] is None
    table = excite("identify", SMOKE, path, *without).stdout
    assert "Error of the torque on held-out data" in table
    assert not [line for line in table.splitlines() if line.startswith("wrist_roll ")]


@pytest.mark.long
@pytest.mark.parametrize("asked", [0, 1, 7])
def test_an_answer_so_far_exists_at_any_time(outcome: Outcome, asked: int) -> None:
    """The search is ended after it asked so many times: what it had is told, and that it ended."""
    times = iter(range(10**9))
    case = load_case(SMOKE, ["diagnosis.kinds=" + KINDS])
    found = diagnose(case, outcome.data, ended=lambda: next(times) >= asked)
    assert [each.kind for each in found.findings].count("cut_short") == 1
    assert not found.complete
    assert found.after.mean_relative_moving < found.before.mean_relative_moving


def test_seconds_that_are_over_end_the_search(outcome: Outcome, excite: Program) -> None:
    seconds = ("--set", "diagnosis.max_seconds=1e-9")
    answer = excite.answer("diagnose", SMOKE, outcome.data, *QUICK, *seconds)
    (told,) = [each["text"] for each in answer["findings"] if each["kind"] == "cut_short"]
    assert "with the answer so far" in told
    assert "diagnosis.max_seconds" in told
