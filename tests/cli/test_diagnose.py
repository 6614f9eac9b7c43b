"""`excite diagnose` as a user runs it, on simulated data of the smoke arm."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

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
        }  # fmt: skip
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
    assert error["sealed_run"] == "motion_2_take_2"
    for when in ("before", "after"):
        assert set(error[when]) >= E_NAMES
        for name in E_NAMES - {"mean_relative", "mean_relative_moving"}:
            assert list(error[when][name]) == JOINTS


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
    assert found.sealed_run == answer["error"]["sealed_run"]
    assert "smoke_arm.urdf" in found.config
    assert found.versions
    assert answer["output"] == {"diagnosis": str(outcome.file), "config": str(outcome.better)}


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
    run = excite("diagnose", SMOKE, outcome.data, *QUICK, "--sealed", "motion_1_take_1")
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
        (("--sealed", "motion_9"), "there is no run 'motion_9'"),
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


def test_help_has_an_example(excite: Program) -> None:
    run = excite("diagnose", "--help")
    assert run.returncode == 0
    assert "excite diagnose ur10.yaml measured.h5" in run.stdout
    assert "--sealed" in run.stdout
