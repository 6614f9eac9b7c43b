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
from excite_cli.config.load import load_spec
from excite_cli.store.diagnosis_file import read_diagnosis
from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

pytest.importorskip("mujoco")

JOINTS = ["shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide"]
KINDS = "[viscous_friction,coulomb_friction,torque_offset,spring,armature]"
QUICK = ("--set", f"diagnosis.kinds={KINDS}")
PLANTED = {("coulomb_friction", "elbow"), ("viscous_friction", "shoulder_pitch")}
E_NAMES = {
    "mean_relative", "mean_relative_moving", "relative", "relative_moving", "rms", "rms_raw",
    "rms_moving", "samples",
}  # fmt: skip


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
    assert {
        "declared_effects", "effects", "absorbed", "unexplained", "error", "next_experiment",
    } <= set(answer)  # fmt: skip
    for effect in answer["effects"]:
        assert set(effect) >= {
            "kind", "joints", "parameters", "p_value", "share_of_residual", "alias_set", "runs",
            "verdict", "removes",
        }  # fmt: skip
        assert effect["verdict"] == "confirmed"
        joint = effect["joints"][0]
        assert set(effect["removes"][joint]) == {"relative", "relative_moving", "rms"}
        assert effect["removes"][joint]["rms"] > 0.1
        for value in effect["parameters"].values():
            assert set(value) == {"value", "std", "unit"}
        assert 0 <= effect["p_value"] <= 0.01
        assert 0 < effect["share_of_residual"] < 1.05  # other rows are fitted at its cost
        assert all({"kind", "joints"} <= set(alias) for alias in effect["alias_set"])
        assert set(effect["joints"]) <= set(JOINTS)
        assert effect["runs"]
    for each in answer["absorbed"]:
        assert set(each) >= {"kind", "joints", "by"}
        assert each["by"]
    for each in answer["unexplained"]:
        assert set(each) >= {"joint", "depends_on", "share_of_residual"}
    error = answer["error"]
    assert error["held_out_run"] == "motion_2_take_2"
    assert error["samples"] == error["after"]["samples"]
    for when in ("before", "after", "untouched"):
        assert set(error[when]) >= E_NAMES
        for name in E_NAMES - {"mean_relative", "mean_relative_moving"}:
            assert list(error[when][name]) == JOINTS


def test_parts_add_up_to_the_fall_of_the_error(outcome: Outcome) -> None:
    answer, error = outcome.answer, outcome.answer["error"]
    assert (error["baseline"], error["inertias_error_reduction"]) == ("before", {})
    for joint in JOINTS:
        parts = sum(each["error_reduction"][joint] for each in answer["effects"])
        before, after = (error[when]["relative_moving"][joint] for when in ("before", "after"))
        assert parts == pytest.approx(before - after, abs=1e-9)
    (elbow,) = (each for each in answer["effects"] if each["joints"] == ["elbow"])
    assert (
        max(elbow["error_reduction"], key=lambda joint: elbow["error_reduction"][joint]) == "elbow"
    )
    assert answer["shares"] == {"friction": pytest.approx(1.0)}
    said = "Friction accounts for nearly all of the unmodelled torque, most on "
    assert answer["answer"].startswith(said)


def test_lines_of_data_sheets_are_told_of_every_joint_with_friction(outcome: Outcome) -> None:
    lines = {each["joint"]: each for each in outcome.answer["friction_lines"]}
    assert set(lines) == {"elbow", "shoulder_pitch"}
    assert lines["elbow"]["coulomb"]["value"] == pytest.approx(2.0, rel=0.05)
    assert lines["shoulder_pitch"]["viscous"]["value"] == pytest.approx(3.0, rel=0.05)


def test_what_was_planted_is_found_with_its_size(outcome: Outcome) -> None:
    answer = outcome.answer
    assert named(answer) == PLANTED
    sizes = {each["kind"]: next(iter(each["parameters"].values())) for each in answer["effects"]}
    assert sizes["coulomb_friction"]["value"] == pytest.approx(2.0, rel=0.05)
    assert sizes["viscous_friction"]["value"] == pytest.approx(3.0, rel=0.05)
    assert sizes["coulomb_friction"]["unit"] == "N·m"
    error = answer["error"]
    for joint in ("elbow", "shoulder_pitch"):
        assert error["after"]["rms"][joint] < 0.5 * error["before"]["rms"][joint]


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


def test_the_model_is_there_in_numbers(outcome: Outcome) -> None:
    model = outcome.answer["model"]
    assert len(model["inertias"]) == 10 * len(JOINTS)
    assert {"m[elbow]", "Izz[slide]"} <= set(model["inertias"])
    values = {(each["kind"], *each["joints"]): each["values"] for each in model["effects"]}
    assert set(values) == PLANTED
    assert values["coulomb_friction", "elbow"] == [pytest.approx(2.0, rel=0.05)]


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


def test_people_get_tables(outcome: Outcome, excite: Program) -> None:
    run = excite("diagnose", SMOKE, outcome.data, *QUICK, "--held-out", "motion_1_take_1")
    assert run.returncode == 0, run.stderr
    for words in (
        "What the declared model lacks", "coulomb_friction", "N·m",
        "Error of the torque on data never used (motion_1_take_1)", "Next motion",
    ):  # fmt: skip
        assert words in run.stdout
    assert list(excite.folder.iterdir()) == []  # nothing is written unasked


def test_files_that_exist_are_kept(outcome: Outcome, excite: Program) -> None:
    path = excite.folder / "there"
    path.write_text("mine")
    for option in ("-o", "--apply"):
        run = excite("diagnose", SMOKE, outcome.data, *QUICK, option, path)
        assert run.returncode == 2
        assert "there exists already" in run.stderr
        assert "--overwrite" in run.stderr
        assert path.read_text() == "mine"
    run = excite("diagnose", SMOKE, outcome.data, "-o", excite.folder)
    assert run.returncode == 2
    assert "is a folder" in run.stderr


def test_one_name_for_two_files_is_refused(outcome: Outcome, excite: Program) -> None:
    run = excite("diagnose", SMOKE, outcome.data, *QUICK, "-o", "x", "--apply", "./x")
    assert run.returncode == 2
    assert "--output and --apply" in run.stderr
    assert list(excite.folder.iterdir()) == []


def test_overwrite_replaces(outcome: Outcome, excite: Program) -> None:
    path = excite.folder / "found.h5"
    path.write_text("old")
    run = excite("diagnose", SMOKE, outcome.data, *QUICK, "-o", path, "--overwrite", "--quiet")
    assert (run.returncode, run.stderr) == (0, "")
    assert "Next motion" in run.stdout
    assert {e.effect.kind for e in read_diagnosis(path).effects} == {kind for kind, _ in PLANTED}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--held-out", "motion_9"), "there is no run 'motion_9'"),
        (("--set", "diagnosis.kinds=[stiction]"), "there is no effect 'stiction'"),
        (("--set", "measurement.filter.position=150"), "beyond half the recorded rate"),
    ],
)
def test_bad_requests_get_one_message(
    outcome: Outcome, excite: Program, arguments: tuple[str, ...], words: str
) -> None:
    run = excite("diagnose", SMOKE, outcome.data, *arguments)
    assert run.returncode == 2
    assert words in run.stderr
    assert run.stdout == ""
    assert "Traceback" not in run.stderr
    assert run.stderr.count("\n") == run.stderr.rstrip().count("\n") + 1


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
    alone = excite("diagnose", SMOKE, mended, *QUICK, "--apply-unconfirmed")
    assert alone.returncode == 2
    assert "--apply-unconfirmed says nothing without --apply" in alone.stderr


@pytest.mark.parametrize("command", ["diagnose", "identify"])
def test_copies_of_training_data_are_refused_as_held_out(
    data: Path, excite: Program, command: str
) -> None:
    copy = excite.folder / "copy.h5"
    shutil.copy(data, copy)
    run = excite(command, SMOKE, data, copy)
    assert run.returncode == 2
    assert "hold the same samples to the last digit" in run.stderr
    assert "motion_2_take_2" in run.stderr
    assert str(copy) in run.stderr
    link = excite.folder / "link.h5"
    link.symlink_to(data)
    run = excite(command, SMOKE, data, link)
    assert run.returncode == 2
    assert "is given twice" in run.stderr


def test_a_joint_without_torque_is_left_out_and_the_others_are_found(
    data: Path, excite: Program, outcome: Outcome
) -> None:
    """Its torque is worthless and its motion counts; nothing is said of it but that."""
    path = excite.folder / "worthless.h5"
    shutil.copy(data, path)
    with h5py.File(path, "r+") as file:
        for run in file["runs"].values():
            run["tau"][:, 3] = 0.0
    refused = excite("diagnose", SMOKE, path, *QUICK)
    assert refused.returncode == 2
    assert "measurement.without_torque" in refused.stderr
    without = ("--set", "measurement.without_torque=[wrist_roll]")
    answer = excite.answer("diagnose", SMOKE, path, *QUICK, *without, "-o", "found.h5")
    named = {(each["kind"], *each["joints"]) for each in answer["effects"]}
    assert named == PLANTED
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
    assert excite("report", "found.h5", "-o", page).returncode == 0
    assert not re.search(r"\bnan\b", page.read_text(encoding="utf-8"))
    fitted = excite.answer("identify", SMOKE, path, *without)
    assert fitted["error"]["rms_raw"]["wrist_roll"] is None
    table = excite("identify", SMOKE, path, *without).stdout
    assert "Error of the torque on held-out data" in table
    assert not [line for line in table.splitlines() if line.startswith("wrist_roll ")]


def test_help_has_an_example(excite: Program) -> None:
    run = excite("diagnose", "--help")
    assert run.returncode == 0
    assert "excite diagnose ur10.yaml measured.h5" in run.stdout
    assert "--held-out" in run.stdout


@pytest.mark.parametrize("asked", [0, 1, 7])
def test_an_answer_so_far_exists_at_any_time(outcome: Outcome, asked: int) -> None:
    """The search is ended after it asked so many times: what it had is told, and that it ended."""
    times = iter(range(10**9))
    case = load_case(SMOKE, ["diagnosis.kinds=" + KINDS])
    found = diagnose(case, outcome.data, ended=lambda: next(times) >= asked)
    assert [each.kind for each in found.findings].count("cut_short") == 1
    assert not found.complete
    assert found.after.mean_relative_moving < found.before.mean_relative_moving


def test_seconds_that_are_over_end_the_search(
    outcome: Outcome, cache: Path, tmp_path: Path
) -> None:
    seconds = ("--set", "diagnosis.max_seconds=1e-9")
    answer = Program(tmp_path, cache).answer("diagnose", SMOKE, outcome.data, *QUICK, *seconds)
    (told,) = [each["text"] for each in answer["findings"] if each["kind"] == "cut_short"]
    assert "with the answer so far" in told
    assert "diagnosis.max_seconds" in told
