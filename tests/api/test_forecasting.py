"""The error to expect on a motion to come, beside what a simulated robot then shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import (
    SimulationSettings,
    export_file,
    forecast,
    identify,
    load_case,
    save_fit,
    score,
    simulate,
)
from excite_cli.api.forecasting import forecast_answer
from excite_cli.api.model import Model
from excite_cli.errors import FileError
from excite_cli.scoring.forecast import Forecast, JointForecast
from tests.api.conftest import SMALL, SMOKE, Loop

pytest.importorskip("mujoco")


def test_it_is_about_what_is_then_measured(loop: Loop, tmp_path: Path) -> None:
    """The same motions, a new recording of them."""
    whole = load_case(SMOKE, [*SMALL, "effects=[{kind: coulomb_friction}]"])
    save_fit(tmp_path / "fit.h5", whole, identify(whole, loop.data))
    found = forecast(tmp_path / "fit.h5", loop.result)
    again = SimulationSettings(torque_noise=0.011)
    new = simulate(loop.problem, loop.result, ["coulomb_friction@elbow=2"], again)
    measured = score(tmp_path / "fit.h5", new.dataset)
    for name, joint in found.joints.items():
        ratio = joint.share / measured.error.relative[name]
        assert 1 / 1.5 < ratio < 1.5, name
    assert found.good
    assert not found.outside
    assert found.seconds == pytest.approx(2 * 6.283, rel=0.2)


def test_a_job_faster_than_the_data_is_said_to_be(loop: Loop, tmp_path: Path) -> None:
    t = np.linspace(0.0, 2.0, 401)
    angle = 6.0 * t
    q = np.stack([0.8 * np.sin(angle), 0.05 * np.sin(angle)], axis=1)
    names = Model.load(loop.fit).joint_names
    plan = tmp_path / "plan.csv"
    head = "t," + ",".join(f"q_{name}" for name in names)
    np.savetxt(plan, np.column_stack([t, q]), delimiter=",", header=head, comments="")
    found = forecast(loop.fit, plan)
    assert "elbow" in found.outside
    assert found.joints["elbow"].fastest > 1.1
    answer = forecast_answer(found)
    assert "Beyond the positions, speeds or loads of the model's data: elbow" in str(
        answer.parts[0]
    )
    assert answer.data["joints"]["elbow"]["error"] == found.joints["elbow"].error
    assert answer.data["outside"] == list(found.outside)


def test_more_error_than_usual_is_a_bad_answer() -> None:
    joint = JointForecast(10.0, 1.0, 0.0, 0.5, 0.0, 0.9, 3.0, 1.0)
    made = Forecast("d.h5", "plan.csv", 5.0, {"elbow": joint}, 0.05, ("N·m",))
    assert made.mean_share == pytest.approx(0.1)
    assert not forecast_answer(made).good
    assert forecast_answer(replace(made, made=0.08)).good
    assert forecast_answer(replace(made, made=None)).good
    # What is expected of its own data, too, is no more error than usual.
    answer = forecast_answer(replace(made, usual=0.09))
    assert answer.good
    assert "(5.00% on its own held-out data, where 9.00% would be expected)" in str(answer.parts[0])
    table = str(forecast_answer(made).parts[1])
    assert "3.0 x" in table


def test_models_are_no_jobs(loop: Loop) -> None:
    with pytest.raises(FileError, match=r"no motions|holds"):
        forecast(loop.fit, loop.fit)


def test_a_motion_is_exported_and_forecast(loop: Loop, tmp_path: Path) -> None:
    written = export_file(loop.result, "csv", tmp_path / "a.csv", chosen=[1])
    of_file = forecast(loop.fit, written.paths[0])
    assert of_file.mean_share > 0.0
