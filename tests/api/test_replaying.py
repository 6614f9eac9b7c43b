"""A log with set points, from simulation to identification to the motion of the exported model."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli import (
    ConfigError,
    Dataset,
    FileError,
    Model,
    SimulationSettings,
    identify,
    load_problem,
    replay,
    simulate,
)
from excite_cli.api.played_runs import _held, set_points
from excite_cli.api.replaying import replay_answer
from excite_cli.api.simulating import PositionDrive
from excite_cli.config.data_spec import DriveLawSpec
from excite_cli.export.drive import Drive
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array
from excite_cli.scoring.records import SetPointReplay
from tests.api.conftest import SMALL, SMOKE, Loop

pytest.importorskip("mujoco")
KP, KD, DELAY = (300.0, 1500.0), (12.0, 60.0), 0.006
DECLARED = [
    "effects=[{kind: coulomb_friction}, {kind: viscous_friction}, {kind: armature}]",
    *SMALL,
]
FRICTION = ["effects=[{kind: coulomb_friction}]", *SMALL]


def law(run: Run) -> Array:
    """The drive's law on a log, as its reader takes it for the torque."""
    behind = np.column_stack([
        column[np.maximum(np.searchsorted(run.t, run.t - DELAY + 1e-6, side="right") - 1, 0)]
        for column in run.extra["q_cmd"].T
    ])  # fmt: skip
    return np.array(KP) * (behind - run.q) - np.array(KD) * np.gradient(run.q, run.t, axis=0)


def commanded(model: Model) -> Model:
    """As a fit of a config with `measurement.torque: command` is stored."""
    command = {"kp": dict(zip(("elbow", "slide"), KP, strict=True)), "delay": DELAY}
    command["kd"] = dict(zip(("elbow", "slide"), KD, strict=True))
    spec = model.made.spec
    changed = {"torque": "command", "command": DriveLawSpec(**command)}
    measurement = spec.measurement.model_copy(update=changed)
    stored = replace(model.made, spec=spec.model_copy(update={"measurement": measurement}))
    return Model(stored)


@pytest.fixture(scope="module")
def data(loop: Loop) -> Dataset:
    effects = ["coulomb_friction@elbow=2", "armature@elbow=0.1", "viscous_friction@slide=5"]
    settings = SimulationSettings(
        encoder=1e-5, drive=PositionDrive(KP, KD, command_rate=250.0, delay=DELAY)
    )
    found = simulate(loop.problem, loop.result, effects, settings, declared=False)
    runs = tuple(replace(run, tau=law(run)) for run in found.dataset.runs)
    return replace(found.dataset, runs=runs)


@pytest.fixture(scope="module")
def fits(data: Dataset, tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Model]:
    """With the effects that are there, and with friction alone."""
    folder = tmp_path_factory.mktemp("fits")
    models = []
    for name, changes in (("whole", DECLARED), ("plain", FRICTION)):
        problem = load_problem(SMOKE, changes)
        identify(problem, data, output=folder / f"{name}.h5")
        models.append(commanded(Model.load(folder / f"{name}.h5")))
    return models[0], models[1]


def test_the_identified_model_moves_as_the_robot(data: Dataset, fits: tuple[Model, Model]) -> None:
    whole, plain = fits
    found = replay(whole, data, held_out=True, beside=plain)
    assert isinstance(found, SetPointReplay)
    described, beside, own = found.models
    assert described.name == "URDF"
    assert (Path(beside.name).name, Path(own.name).name) == ("plain.h5", "whole.h5")
    assert found.names == ("motion_2",)
    assert found.good
    assert own.mean < 0.25 * described.mean
    assert beside.mean < described.mean
    assert own.whole["slide"] < 0.5 * beside.whole["slide"], "its viscous friction"
    assert own.mean < 1e-3
    assert found.horizons == (0.1, 1.0, 10.0)
    assert found.starts[0] == found.starts[1] == 40
    assert found.starts[2] == 0, "the log lasts six seconds"
    assert np.isnan(own.after["elbow"][2])
    assert own.after["elbow"][1] < 2e-3
    assert found.sliding == ("slide",)
    answer = replay_answer(found)
    assert answer.good
    assert "the model deviates from the robot by" in str(answer.parts[0])


def test_a_model_that_is_no_better_is_reported(data: Dataset, fits: tuple[Model, Model]) -> None:
    found = replay(fits[0], data)
    assert isinstance(found, SetPointReplay)
    worse = replace(found, models=found.models[::-1])
    answer = replay_answer(worse)
    assert not answer.good
    assert "which is no improvement" in answer.data["answer"]
    assert answer.data["models"][0]["after"]["elbow"][2] is None
    lost = replace(found.models[0], lost=True)
    fallen = replay_answer(replace(found, models=(lost, *found.models[1:])))
    assert fallen.data["answer"].endswith("URDF left all bounds.")


def test_what_cannot_be_played_is_refused(
    loop: Loop, data: Dataset, fits: tuple[Model, Model]
) -> None:
    without = replace(data, runs=tuple(replace(run, extra={}) for run in data.runs))
    with pytest.raises(FileError, match=r"has no set points \(q_cmd\).*measurement\.channels"):
        replay(fits[0], without)
    with pytest.raises(ConfigError, match=r"--beside: only where set points are played"):
        replay(loop.fit, loop.data, beside=loop.fit)
    other = load_problem(SMOKE, ["constraints={}"])
    model = replace(fits[1].made, robot=other.robot)
    with pytest.raises(FileError, match=r"--beside .*plain\.h5: it is of another robot"):
        replay(fits[0], data, beside=Model(model))


def test_speeds_and_torques_that_are_sent_are_in_the_command(fits: tuple[Model, Model]) -> None:
    """k_p (ctrl − q) − k_d v is the whole law."""
    t = np.arange(4) * 0.01
    rng = np.random.default_rng(0)
    sent: dict[str, Any] = {name: rng.normal(size=(4, 2)) for name in ("q_cmd", "v_cmd", "tau_ff")}
    kp, kd = np.array(KP), np.array(KD)
    drive = Drive(kp, kd, np.full(2, np.inf), np.zeros(2))
    run = Run("a", t, np.zeros((4, 2)), np.zeros((4, 2)), extra=sent)
    prepared: Any = SimpleNamespace(t=t, q=run.q, v=run.q)
    played = set_points(fits[0].made.robot, drive, run, prepared)
    wanted = kp * sent["q_cmd"] + kd * sent["v_cmd"] + sent["tau_ff"]
    np.testing.assert_allclose(kp * played.ctrl, wanted)


def test_what_is_missing_is_held() -> None:
    values = np.array([[1.0, np.nan], [np.nan, 5.0], [3.0, np.nan]])
    found = _held(values)
    assert found[:, 0].tolist() == [1.0, 1.0, 3.0]
    assert found[1:, 1].tolist() == [5.0, 5.0]
