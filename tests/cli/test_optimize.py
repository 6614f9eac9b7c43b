import json
import re

import numpy as np
import pytest

from excite_cli.store.result_file import read_result
from tests.api.test_same_answers import same
from tests.cli.conftest import Run
from tests.cli.program import BRIEF, SMOKE, Program

KEYS = {"index", "condition_number", "stacked_condition_number", "status", "seconds", "iterations",
        "evaluations"}  # fmt: skip


def test_json_is_all_of_stdout_and_what_the_file_says(two_motions: Run) -> None:
    answer = json.loads(two_motions.process.stdout)  # fails on any word beside it
    assert two_motions.process.stdout.count("\n") == 1
    assert answer["output"] == str(two_motions.path)
    assert [motion["index"] for motion in answer["motions"]] == [1, 2]
    for told, stored in zip(answer["motions"], read_result(two_motions.path).motions, strict=True):
        assert {key: told[key] for key in KEYS} == {key: getattr(stored, key) for key in KEYS}
        assert min(told["iterations"], told["evaluations"]) > 0
        assert all(worst["margin"] >= 0 for worst in told["margins"].values())


def test_the_second_motion_lowers_the_condition_number_of_the_stack(two_motions: Run) -> None:
    first, second = read_result(two_motions.path).motions
    assert first.condition_number == pytest.approx(first.stacked_condition_number, rel=1e-9)
    assert second.stacked_condition_number < first.stacked_condition_number
    assert second.stacked_condition_number < second.condition_number
    told = two_motions.process.stderr  # for people
    assert all(each in told for each in ("smoke_arm: 5 joints", "self_collision", "motion 2: cond"))
    assert len(told.splitlines()) == 4  # what was understood in two lines, then the motions


def test_quiet_gives_the_answer_only_and_seed_and_set_count(
    excite: Program, two_motions: Run
) -> None:
    run = excite.good("optimize", SMOKE, *BRIEF, "--motions", "1", "--seed", "9", "--quiet")
    assert run.stderr == ""
    assert "Condition numbers" in run.stdout
    result = read_result(excite.folder / "smoke.h5")  # named after the config
    assert result.seed == 9
    assert "seed: 9" in result.config
    assert "max_iterations: 12" in result.config
    other = read_result(two_motions.path).motions[0]
    assert not np.allclose(result.motions[0].coefficients, other.coefficients)


def test_an_existing_file_is_refused_and_left_alone(excite: Program, two_motions: Run) -> None:
    path = excite.folder / "arm.h5"
    path.write_bytes(two_motions.path.read_bytes())
    told = excite.refused("optimize", SMOKE, "-o", path, *BRIEF)
    assert f"{path} exists already" in told
    assert all(way in told for way in ("-o", "--resume", "--overwrite"))
    assert path.read_bytes() == two_motions.path.read_bytes()


def test_overwrite_leaves_the_old_file_where_nothing_replaces_it(excite: Program) -> None:
    path = excite.folder / "arm.h5"
    path.write_text("kept", encoding="utf-8")
    excite.refused("optimize", SMOKE, "-o", path, "--overwrite", "--set", "optimizer.max_seconds=x")
    assert path.read_text(encoding="utf-8") == "kept"


def test_overwrite_with_tables_on_stdout_and_details_on_stderr(excite: Program) -> None:
    path = excite.folder / "arm.h5"
    path.write_text("to be replaced", encoding="utf-8")
    run = excite.good("optimize", SMOKE, "-o", path, *BRIEF, "--motions", "1", "--overwrite", "-v")
    (motion,) = read_result(path).motions
    assert f"{motion.condition_number:.2f}" in run.stdout
    for word in ("joint_torque", "self_collision", "rad/s²", str(path)):
        assert word in run.stdout
    dropped = [line for line in run.stderr.splitlines() if line.startswith("  dropped")]
    checked = [line for line in run.stderr.splitlines() if line.startswith("  checked")]
    assert f"{len(checked)} pairs checked" in run.stderr
    counts = re.search(r"checked; not checked: (.*)", run.stderr)
    assert counts is not None
    assert sum(int(number) for number in re.findall(r"\d+", counts[1])) == len(dropped)
    assert "base parameter" in run.stderr


def test_a_prior_makes_the_stack_better_than_the_motion(excite: Program, two_motions: Run) -> None:
    prior = read_result(two_motions.path)
    answer = excite.answer(
        "optimize", SMOKE, "-o", "more.h5", *BRIEF, "--motions", "1", "--seed", "3",
        "--prior", two_motions.path,
    )  # fmt: skip
    (motion,) = answer["motions"]
    assert motion["index"] == 1
    assert motion["stacked_condition_number"] < motion["condition_number"]
    result = read_result(excite.folder / "more.h5")
    assert result.priors == (str(two_motions.path),)
    assert result.stack.rows == 3 * prior.stack.rows / 2
    gram = result.stack.factor.T @ result.stack.factor
    less = np.linalg.eigvalsh(gram - prior.stack.factor.T @ prior.stack.factor)
    assert less.min() > 0  # what remains is the motion's own, and it shows every parameter
    squares = np.linalg.eigvalsh(gram)
    assert motion["stacked_condition_number"] == pytest.approx(
        np.sqrt(squares[-1] / squares[0]), rel=1e-6
    )


# What nothing can meet, with all other constraints that could be named instead.
INFEASIBLE = {
    "balance": [
        "constraints.self_collision=null",
        "constraints.balance={kind: disc, radius: 0.001, center: [9, 9]}",
    ],
    "torque": ["constraints.self_collision=null", "constraints.torque.scale=0.01"],
    "self_collision": ["constraints.self_collision.margin=10"],
}


@pytest.mark.parametrize("kind", INFEASIBLE)
def test_an_impossible_constraint_is_named_and_nothing_is_written(
    excite: Program, kind: str
) -> None:
    changes = [word for change in INFEASIBLE[kind] for word in ("--set", change)]
    reason = excite.refused("optimize", SMOKE, *BRIEF, *changes, status=1)
    assert kind in reason.partition("error: No admissible motion")[2]
    assert list(excite.folder.iterdir()) == []


def test_paths_in_a_config_start_from_the_config(excite: Program) -> None:
    place = excite.folder / "place"
    place.mkdir()
    text = SMOKE.read_text(encoding="utf-8").replace("../data/smoke_arm.urdf", "arm.urdf")
    (place / "arm.yaml").write_text(text, encoding="utf-8")
    urdf = (SMOKE.parent / "../data/smoke_arm.urdf").read_text(encoding="utf-8")
    (place / "arm.urdf").write_text(urdf, encoding="utf-8")
    excite.good("optimize", "place/arm.yaml", *BRIEF, "--motions", "1")
    assert (excite.folder / "arm.h5").is_file()


FEW = (
    "--set", "optimizer.max_iterations=4", "--set", "constraints.self_collision=null",
    "--set", "optimizer.max_seconds=600", "--motions", "1",
)  # fmt: skip


@pytest.mark.long
def test_starts_shared_by_two_are_stored_alike(excite: Program) -> None:
    asked = ("optimize", SMOKE, *FEW, "--starts", "2", "--json")
    runs = [excite(*asked, "-o", "alone.h5"), excite(*asked, "-o", "shared.h5", "--workers", "200")]
    assert "200 workers share" in runs[1].stderr
    assert "hint: 2 starts" in runs[1].stderr
    assert "hint" not in runs[0].stderr
    alone, shared = (json.loads(run.stdout) for run in runs)
    assert alone["motions"][0]["iterations"] == 8
    for answer in (alone, shared):
        del answer["motions"][0]["seconds"], answer["output"], answer["next"]
    assert alone == shared
    first, second = (read_result(excite.folder / f"{name}.h5") for name in ("alone", "shared"))
    assert same(first, second)


def test_two_places_are_one_too_many(excite: Program) -> None:
    both = ("--workers", "2", "--scheduler", "tcp://127.0.0.1:9")
    assert "give one of them" in excite.refused("optimize", SMOKE, *FEW, *both)
    assert list(excite.folder.iterdir()) == []


# What the motions are expected to tell.


def test_json_has_what_is_predicted_shown_and_not_modelled(two_motions: Run) -> None:
    answer = json.loads(two_motions.process.stdout)
    deviations = [motion["predicted_deviation"] for motion in answer["motions"]]
    assert 0.0 < deviations[1] < deviations[0]
    kinds = {each["kind"] for each in answer["power"]}
    assert {"stribeck_friction", "load_dependent_friction", "armature"} <= kinds
    assert all(each["power"] == 0.95 for each in answer["power"])
    assert answer["not_modelled"][0].startswith("the floor")


def test_a_first_look_makes_one_start_of_few_iterations(excite: Program) -> None:
    run = excite.good("optimize", SMOKE, "--quick", "--motions", "1", "--json")
    (motion,) = json.loads(run.stdout)["motions"]
    assert motion["iterations"] <= 50
    assert "--quick makes one start" in excite.refused("optimize", SMOKE, "--quick", "--starts", 3)


def test_the_power_of_a_size_is_told_for_every_joint(excite: Program) -> None:
    size = "load_dependent_friction=0.03"
    run = excite.good("optimize", SMOKE, *BRIEF, "--motions", "1", "--power", size, "--json")
    power = json.loads(run.stdout)["power"]
    assert [each["size"] for each in power] == [0.03] * 5
    assert all(0.0 <= each["power"] <= 1.0 for each in power)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("stribek_friction=1", "--power: there is no effect 'stribek_friction'. Did you mean"),
        ("stribeck_friction", "--power stribeck_friction: give the kind of an effect and a size"),
        ("backlash=0.01", "backlash: no planned motion shows it"),
    ],
)
def test_a_power_that_cannot_be_told_says_why(excite: Program, asked: str, told: str) -> None:
    assert told in excite.refused("optimize", SMOKE, *BRIEF, "--power", asked)
