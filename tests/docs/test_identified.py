"""Models of real robots: they load, predict as they say, and the page says the same."""

import pytest

from benchmarks.real_robots import DATA
from docs.make_identified import FIRST, MODELS, PAGE, PART, head_of, table
from excite_cli import Model, score


@pytest.mark.parametrize("robot", FIRST)
def test_a_model_predicts_the_held_out_torque_as_it_says(robot: str) -> None:
    path = MODELS / f"{robot}.yaml"
    found = score(path, DATA / robot / FIRST[robot].file, held_out=True, tell=lambda note: None)
    told = float(head_of(robot)["held-out error, after"])
    assert found.error.mean_relative_moving == pytest.approx(told, rel=0.02)
    mujoco = pytest.importorskip("mujoco")
    simulated = mujoco.MjModel.from_xml_path(str(path.with_suffix(".xml")))
    joints = [simulated.joint(j).name for j in range(simulated.njnt)]
    assert tuple(joints) == Model.load(path).joint_names


def test_the_page_says_what_the_models_say() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert PART.replaced(page, table()) == page


def test_models_are_small_and_all_on_the_page() -> None:
    assert {path.stem for path in MODELS.iterdir()} == set(FIRST)
    assert sum(path.stat().st_size for path in MODELS.iterdir()) < 300_000
