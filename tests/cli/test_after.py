"""`excite optimize --after` and measured data as `--prior`, as a user runs them."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import build_problem
from excite_cli.store.diagnosis_file import write_diagnosis
from excite_cli.store.result_file import read_result
from tests.cli.program import BRIEF, SMOKE, Program
from tests.diagnosis.synthetic_diagnosis import make_diagnosis


@pytest.fixture(scope="module")
def diagnoses(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("diagnoses")
    write_diagnosis(folder / "alias.h5", make_diagnosis())
    write_diagnosis(folder / "clear.h5", make_diagnosis(rivals=()))
    return folder / "alias.h5", folder / "clear.h5"


@pytest.mark.long
def test_a_separating_motion_is_a_result_like_any_other(
    excite: Program, diagnoses: tuple[Path, Path]
) -> None:
    alias, _ = diagnoses
    answer = excite.answer("optimize", SMOKE, "--after", alias, "-o", "next.h5", "--motions", "1")
    told = answer["next_experiment"]
    assert told["purpose"] == "separate"
    (pair,) = told["pairs"]
    assert pair["effect"] == "viscous_friction on elbow"
    assert pair["kl_so_far"] < 3 < pair["expected_kl"] == told["expected_kl"]
    assert pair["motions_needed"] == 1
    assert [motion["index"] for motion in answer["motions"]] == [1]
    path = excite.folder / "next.h5"
    assert read_result(path).priors == (str(alias),)
    checked = excite.answer("check", SMOKE, path)
    assert all(motion["violations"] == 0 for motion in checked["motions"])
    again = excite.good("optimize", SMOKE, "--after", alias, "-o", path, *BRIEF, "--resume")
    assert "the next motion separates these indistinguishable effects" in again.stderr
    assert "Kullback-Leibler divergence" in again.stdout
    assert len(read_result(path).motions) == 2


def test_without_aliases_the_extended_model_is_excited(
    excite: Program, diagnoses: tuple[Path, Path]
) -> None:
    _, clear = diagnoses
    words = ("--after", clear, "-o", "next.h5", "--motions", "1")
    run = excite.good("optimize", SMOKE, *BRIEF, *words)
    assert "all effects are distinguishable" in run.stderr
    result = read_result(excite.folder / "next.h5")
    assert result.effect_names == ("viscous_friction[elbow].viscous",)
    assert result.prior_stack.rows > 0


def test_what_does_not_go_with_after(excite: Program, diagnoses: tuple[Path, Path]) -> None:
    alias, _ = diagnoses
    for arguments, words in (
        (("--after", alias, "--prior", alias), "leave --prior out"),
        (("--prior", alias), "Plan on top of it with --after"),
        (("--after", alias, "--set", "robot.joints=[elbow, slide]"), "another robot"),
    ):
        assert words in excite.refused("optimize", SMOKE, *BRIEF, *arguments)
    assert list(excite.folder.iterdir()) == []


def test_measured_data_are_earlier_data(excite: Program) -> None:
    problem = build_problem(load_spec(SMOKE, ["constraints={}"]), SMOKE.parent)
    rng = np.random.default_rng(3)
    alpha = problem.still(problem.robot.posture)
    alpha = alpha + 0.1 * rng.normal(size=alpha.shape)
    times = np.arange(0.0, 24.0, 0.005)
    q = problem.trajectory.basis(times).position @ alpha
    tau = rng.normal(size=q.shape) + 5.0 * np.sin(times)[:, None]
    names = problem.robot.joint_names
    header = ",".join(["t", *(f"q_{n}" for n in names), *(f"tau_{n}" for n in names)])
    path = excite.folder / "measured.csv"
    np.savetxt(path, np.column_stack([times, q, tau]), delimiter=",", header=header, comments="")
    words = ("--motions", "1", "--prior", path, "-o", "more.h5")
    run = excite.good("optimize", SMOKE, *BRIEF, *words)
    assert "1 run of measured data" in run.stderr
    result = read_result(excite.folder / "more.h5")
    assert result.priors == (str(path),)
    assert result.prior_stack.rows > 5 * 200
    (motion,) = result.motions
    assert motion.stacked_condition_number == pytest.approx(
        np.linalg.cond(result.stack.factor), rel=1e-6
    )
