"""What the terminal refuses with a sentence, a script is refused with the same sentence."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import (
    Case,
    ConfigError,
    ExciteError,
    FileError,
    Problem,
    Result,
    check,
    compare_random,
    export_file,
    load_data,
    load_problem,
    motions_of,
    plan,
    plan_after,
    read_diagnosis,
    read_fit,
    read_result,
    simulate,
    write_dataset,
    write_result,
)
from excite_cli.excitation.objective import Stack
from tests.api.conftest import BRIEF, SMOKE, Loop

OTHER_JOINTS = "moves other joints than the config: shoulder_yaw, shoulder_pitch, elbow"


@pytest.mark.parametrize("read", [read_result, read_fit, read_diagnosis])
def test_a_missing_file_is_one_sentence(read: Callable[[str], object], tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"There is no file .*none\.h5"):
        read(str(tmp_path / "none.h5"))


def test_motions_of_another_robot_are_refused(
    other: Problem, other_case: Case, result: Result, stored: Path
) -> None:
    for given in (result, str(stored)):
        with pytest.raises(FileError, match=OTHER_JOINTS):
            check(other, given)
        with pytest.raises(FileError, match="the config: it was made for another robot, other mo"):
            compare_random(other, given)
        for model in (other, other_case):
            with pytest.raises(FileError, match=OTHER_JOINTS):
                simulate(model, given)
    with pytest.raises(FileError, match=OTHER_JOINTS):
        plan(other, starts=stored)
    for call in (check, simulate):
        with pytest.raises(FileError, match=r"shape \(9, 5\).*6 joints of ur10.*\(9, 6\)"):
            call(other, motions_of(result))
    with pytest.raises(FileError, match="does not belong to the problem: it was made for another"):
        write_result(stored.with_name("x.h5"), result, other)


def test_starts_of_another_shape_are_refused(problem: Problem, result: Result) -> None:
    (start,) = motions_of(result)
    narrow = replace(start, coefficients=start.coefficients[:, :3])
    with pytest.raises(FileError, match=r"motion_1 has coefficients of the shape \(9, 3\)"):
        plan(problem, starts=[narrow])
    short = replace(start, coefficients=start.coefficients[:-1])
    with pytest.raises(FileError, match=r"shape \(8, 5\)"):
        plan(problem, starts=short)
    with pytest.raises(FileError, match="ndarray is not a motion"):
        plan(problem, starts=np.zeros((2, 3)))  # type: ignore[arg-type]


def test_what_is_no_motion_is_named(problem: Problem, result: Result) -> None:
    with pytest.raises(FileError, match="Case is not a motion"):
        check(problem, Case(problem.spec, problem.folder, problem.robot))  # type: ignore[arg-type]
    with pytest.raises(FileError, match="holds no JointTrajectory"):
        check(problem, SMOKE)
    with pytest.raises(FileError, match=r"the result has no motion 7; it has 1 \(--motion\)"):
        motions_of(result, [7])
    with pytest.raises(FileError, match="the result holds no motion"):
        motions_of(replace(result, motions=()))
    motion = motions_of(result)[0]
    with pytest.raises(FileError, match="Two motions are called motion_1"):
        check(problem, [motion, motion])
    wider = load_problem(SMOKE, [*BRIEF, "trajectory.harmonics=3"])
    with pytest.raises(FileError, match="the result has motions of another trajectory section"):
        check(wider, result)


def test_priors_that_do_not_fit_are_refused(
    problem: Problem, other: Problem, result: Result, stored: Path
) -> None:
    with pytest.raises(FileError, match="--prior prior 1 cannot be stacked: it was made for"):
        plan(other, priors=[result])
    with pytest.raises(FileError, match="it has 3 columns, the regressor of this problem 26"):
        plan(problem, priors=[Stack.empty(3)])
    with pytest.raises(ConfigError, match=r"one of priors is Case.*Give text, Path, Result"):
        plan(problem, priors=[Case(problem.spec, problem.folder, problem.robot)])  # type: ignore[list-item]
    with pytest.raises(FileError, match=r"arm\.h5"):  # it is no diagnosis
        plan_after(problem, stored)


def test_an_existing_output_is_kept(problem: Problem, result: Result, stored: Path) -> None:
    before = stored.read_bytes()
    with pytest.raises(FileError, match=r"exists already.*--resume.*--overwrite"):
        plan(problem, output=stored)
    with pytest.raises(ConfigError, match="give one"):
        plan(problem, output=stored, resume=True, overwrite=True)
    with pytest.raises(FileError, match="exists already"):
        compare_random(problem, result, candidates=1, seconds=0, output=str(stored))
    for call in (
        lambda: compare_random(problem, str(stored), output=stored, overwrite=True),
        lambda: plan(problem, starts=stored, output=stored, overwrite=True),
    ):
        with pytest.raises(FileError, match=r"would replace .*arm\.h5, which is read here"):
            call()
    assert stored.read_bytes() == before


def test_measured_data_of_other_joints_are_refused(other: Problem, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,q0,tau0\n0,0,0\n0.1,0,0\n")
    with pytest.raises(ExciteError, match=r"log\.csv"):
        load_data(other, str(path))


KEPT: dict[str, Callable[[Problem, Path, Path], object]] = {
    "plan": lambda problem, stored, to: plan(problem, output=to, overwrite=True),
    "compare_random": lambda problem, stored, to: compare_random(
        problem, stored, candidates=1, seconds=0, output=to, overwrite=True
    ),
    "simulate": lambda problem, stored, to: simulate(problem, stored, output=to, overwrite=True),
    "write_result": lambda problem, stored, to: write_result(to, read_result(stored), problem),
}


@pytest.mark.parametrize("name", KEPT)
def test_a_script_never_replaces_the_config(name: str, stored: Path, tmp_path: Path) -> None:
    config = tmp_path / "arm.yaml"
    urdf = SMOKE.parents[1] / "data" / "smoke_arm.urdf"
    config.write_text(SMOKE.read_text().replace("../data/smoke_arm.urdf", str(urdf)))
    link = tmp_path / "link.yaml"
    link.symlink_to(config)
    before, problem = config.read_bytes(), load_problem(config, BRIEF)
    for output in (config, link):
        with pytest.raises(FileError, match=r"would replace .*arm\.yaml, which is read here"):
            KEPT[name](problem, stored, output)
    assert config.read_bytes() == before


def test_data_at_hand_keep_their_file(loop: Loop) -> None:
    before = loop.data.read_bytes()
    data = load_data(loop.problem, loop.data)
    for call in (
        lambda: plan(loop.problem, priors=[data], output=loop.data, overwrite=True),
        lambda: simulate(loop.problem, data, output=loop.data, overwrite=True),
        lambda: write_dataset(loop.data, data),
        lambda: export_file(loop.fit, "yaml", loop.data, overwrite=True),
    ):
        with pytest.raises(FileError, match=r"would replace .*data\.h5, which is read here"):
            call()
    assert loop.data.read_bytes() == before


def test_a_log_counts_once(loop: Loop, tmp_path: Path) -> None:
    again = tmp_path / "again.h5"
    again.symlink_to(loop.data)
    with pytest.raises(FileError, match=r"again\.h5 is given twice"):
        load_data(loop.problem, [loop.data, again])
