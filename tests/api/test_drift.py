"""How far a simulation with a scored model drifts from the robot."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import Dataset, Model, Score, SimulationSettings, identify, load_problem, score
from excite_cli import simulate as played
from excite_cli.api.scoring import score_answer
from excite_cli.scoring.records import HorizonDrift, ScoredRun
from excite_cli.shown.answer import Table
from tests.api.conftest import SMALL, SMOKE, Loop

pytest.importorskip("mujoco")
FRICTION = "effects=[{kind: coulomb_friction}, {kind: viscous_friction}]"


@pytest.fixture(scope="module")
def data(loop: Loop) -> Dataset:
    effects = ["coulomb_friction@elbow=2", "viscous_friction@slide=5"]
    settings = SimulationSettings(encoder=1e-5, torque_noise=1e-3)
    return played(loop.problem, loop.result, effects, settings, declared=False).dataset


def scored(data: Dataset, file: Path, *changes: str) -> Score:
    identify(load_problem(SMOKE, [*changes, *SMALL]), data, output=file)
    return score(Model.load(file), data, held_out=True)


@pytest.mark.long
def test_a_model_with_the_friction_of_the_robot_drifts_less(data: Dataset, tmp_path: Path) -> None:
    right, bare = scored(data, tmp_path / "right.h5", FRICTION), scored(data, tmp_path / "bare.h5")
    assert [each.horizon for each in right.drift] == [0.1, 1.0], "the log lasts six seconds"
    assert [each.starts for each in right.drift] == [40, 40]
    for own, other in zip(right.drift, bare.drift, strict=True):
        assert own.still == other.still, "of the robot alone"
        for joint in ("elbow", "slide"):
            assert own.median[joint] < 0.2 * other.median[joint]
            assert own.median[joint] <= own.worst[joint]
            assert own.median[joint] < 0.25 * min(own.still[joint], own.steady[joint])
        assert own.beyond == ()
    answer = score_answer(right)
    assert answer.data["drift"][1]["median"]["elbow"] == right.drift[1].median["elbow"]
    assert answer.data["runs"][0]["drift"] == answer.data["drift"]
    table = next(it for it in answer.parts if isinstance(it, Table) and "Drift" in it.title)
    assert [row[0] for row in table.rows] == ["0.1 s", "1 s"]
    assert table.title.endswith("[mrad (mm)]")


def test_without_mujoco_one_line_says_what_to_install(
    loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    found = score(loop.fit, loop.data)
    assert found.drift == ()
    told = [str(part) for part in score_answer(found).parts if "simulation" in str(part)]
    assert len(told) == 1
    assert "pip install 'excite-cli[sim]'" in told[0]
    assert score_answer(found).data["not_simulated"] in told[0]


def test_runs_count_by_their_starts(loop: Loop) -> None:
    (one, *_) = score(loop.fit, loop.data).runs
    drifts = [
        HorizonDrift(1.0, starts, {"a": median}, {"a": 2 * median}, {"a": 3.0}, {"a": np.inf})
        for starts, median in ((10, 1.0), (30, 5.0))
    ]
    runs: list[ScoredRun] = [replace(one, drift=(each,)) for each in drifts]
    (whole,) = replace(score(loop.fit, loop.data), runs=tuple(runs)).drift
    assert (whole.starts, whole.median["a"], whole.worst["a"]) == (40, 4.0, 10.0)
    assert whole.beyond == ("a",)
