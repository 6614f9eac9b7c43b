"""Identified models in other programs: randomization, and drives that follow set points."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli import ConfigError, ExciteError, FileError, Note, diagnose, export_file
from excite_cli.api import model_exports
from excite_cli.api.model_exports import uncertain_model
from excite_cli.config.data_spec import DriveLawSpec
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.robot.model import Array
from excite_cli.simulation.build import true_inertias
from excite_cli.store.model_file import read_model
from tests.api.conftest import SMOKE, Loop

mujoco = pytest.importorskip("mujoco")
PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "model.md"


@pytest.fixture(scope="module")
def ranges(loop: Loop, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ranges") / "ranges.json"
    export_file(loop.fit, "randomization", path, samples=20, seed=3)
    return path


def commanded(monkeypatch: pytest.MonkeyPatch, command: Any) -> None:
    """Models are read as those of robots that follow set points."""

    def read(path: Path) -> Any:
        stored = read_model(path)
        changed = {"torque": "command", "command": DriveLawSpec(**command)}
        measurement = stored.spec.measurement.model_copy(update=changed)
        return replace(stored, spec=stored.spec.model_copy(update={"measurement": measurement}))

    monkeypatch.setattr(model_exports, "read_model", read)


def inertia_of(model: Any, body: str) -> Array:
    """About the centre of mass, in the axes of the body's frame (3, 3)."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body(body).iquat)
    axes = rotation.reshape(3, 3)
    return np.asarray(axes @ np.diag(model.body(body).inertia) @ axes.T)


def test_numbers_are_those_of_the_exported_model(loop: Loop, ranges: Path, tmp_path: Path) -> None:
    found = json.loads(ranges.read_text(encoding="utf-8"))
    export_file(loop.fit, "mjcf", tmp_path / "arm.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    mean = dict(zip(found["names"], found["mean"], strict=True))
    units = dict(zip(found["names"], found["units"], strict=True))
    assert found["links"] == {"body_of_elbow": "forearm", "body_of_slide": "tool"}
    for body in found["links"]:
        assert mean[f"{body}/mass"] == pytest.approx(model.body(body).mass[0])
        assert mean[f"{body}/com_y"] == pytest.approx(model.body(body).ipos[1])
        inertia = inertia_of(model, body)
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            name = f"{body}/inertia_{'xyz'[i]}{'xyz'[j]}"
            assert mean[name] == pytest.approx(inertia[i, j], abs=1e-8)
    assert units["body_of_elbow/inertia_xy"] == "kg·m²"
    assert found["delay"] is None
    assert len(found["samples"]) == 20
    assert {len(sample) for sample in found["samples"]} == {len(found["names"])}
    covariance = np.array(found["covariance"])
    assert np.sqrt(np.diag(covariance)) == pytest.approx(found["std"])
    assert np.linalg.eigvalsh(covariance / np.outer(found["std"], found["std"])).min() > -1e-6


def test_the_documented_loader_makes_the_sampled_robots(
    loop: Loop, ranges: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ranges.json").write_bytes(ranges.read_bytes())
    commanded(monkeypatch, {"kp": 100.0, "kd": 2.0})
    export_file(loop.fit, "mjcf", tmp_path / "arm.xml")
    export_file(loop.fit, "randomization", tmp_path / "ranges.json", samples=3, overwrite=True)
    monkeypatch.chdir(tmp_path)
    (code,) = (
        block
        for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
        if "def randomize" in block
    )
    scope: dict[str, Any] = {}
    exec(compile(code, "loader.py", "exec"), scope)
    found = json.loads((tmp_path / "ranges.json").read_text("utf-8"))
    sample, model = dict(zip(found["names"], found["samples"][0], strict=True)), scope["robot"]
    assert model.body("body_of_elbow").mass[0] == sample["body_of_elbow/mass"]
    assert model.actuator("elbow").gainprm[0] == sample["elbow/kp"] == 100.0
    assert model.actuator("elbow").biasprm[:3].tolist() == [0.0, -100.0, -2.0]
    inertia = inertia_of(model, "body_of_elbow")
    assert inertia[0, 1] == pytest.approx(sample["body_of_elbow/inertia_xy"])
    assert inertia[2, 2] == pytest.approx(sample["body_of_elbow/inertia_zz"])
    for k in range(3):
        scope["randomize"](model, found, k)
        mujoco.mj_step(model, mujoco.MjData(model))


def test_samples_cover_the_torque_of_the_robot(loop: Loop) -> None:
    """Torques of the simulated robot on other states: 95 % lie among 95 % of the samples'."""
    stored = read_model(loop.fit)
    found = uncertain_model(stored)
    drawn = found.drawn(120, seed=1)
    states = stored.robot.draw_states(150, seed=5)
    truth = RigidBody(stored.robot, true_inertias(stored.robot, 0.2, 1), *states).load
    torques = np.array([RigidBody(stored.robot, found.bodies(x), *states).load for x in drawn])
    low, high = np.quantile(torques, [0.025, 0.975], axis=0)
    inside = np.mean((truth >= low) & (truth <= high))
    assert inside > 0.8
    spread = torques.std(axis=0).mean() / np.abs(truth).mean()
    assert spread < 0.15, "torques are known, whatever links are"


def test_a_diagnosis_has_them_as_well(loop: Loop, tmp_path: Path) -> None:
    diagnose(loop.problem, loop.data, output=tmp_path / "found.h5")
    export_file(tmp_path / "found.h5", "randomization", tmp_path / "a.json", samples=5)
    found = json.loads((tmp_path / "a.json").read_text("utf-8"))
    at = found["names"].index("elbow/frictionloss")
    friction = np.array(found["samples"])[:, at]
    assert found["mean"][at] == pytest.approx(2.0, abs=0.3)
    assert 0.0 < found["std"][at] < 0.3
    assert np.abs(friction - 2.0).max() < 0.5
    assert set(found["torque_left"]) == {"elbow", "slide"}
    assert all(0.0 < rms < 0.5 for rms in found["torque_left"].values())


def test_what_has_no_covariance_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"smoke\.yaml holds no covariance\. Give the fit"):
        export_file(SMOKE, "randomization", tmp_path / "a.json")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("format", "options", "words"),
    [
        ("mjcf", {"samples": 5}, "--samples: only --format randomization draws samples"),
        ("c", {"seed": 5}, "--seed: only --format randomization"),
        ("randomization", {"samples": 0}, "--samples 0: allowed: 1 to 100,000"),
        ("isaaclab", {}, r"--format isaaclab holds drives .* torque was measured\. Take mjcf"),
        ("mjlab", {}, "--format mjlab holds drives"),
        ("bam", {}, "--format bam holds drives"),
    ],
)
def test_bad_requests(
    loop: Loop, tmp_path: Path, format: str, options: dict[str, int], words: str
) -> None:
    with pytest.raises(ExciteError, match=words):
        export_file(loop.fit, format, tmp_path / "x", **options)
    assert not list(tmp_path.iterdir())


def test_motions_have_no_samples(loop: Loop, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--samples, --seed: only --format randomization"):
        export_file(loop.result, "csv", tmp_path / "x.csv", samples=3)


@pytest.mark.parametrize("format", ["isaaclab", "mjlab", "bam", "mjcf"])
def test_drives_are_written(
    loop: Loop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format: str
) -> None:
    commanded(monkeypatch, {"kp": {"elbow": 123.0, "slide": 50.0}, "kd": 2.0, "delay": 0.01})
    monkeypatch.chdir(tmp_path)
    told: list[Note] = []
    (path,) = export_file(loop.fit, format, tell=told.append).paths
    text = path.read_text("utf-8")
    assert "123" in text
    assert "0.01" in text or "0.0099999" in text
    names = {"isaaclab": "fit_isaaclab.py", "mjlab": "fit_mjlab.py", "bam": "fit_bam.json"}
    assert path.name == names.get(format, "fit.xml")
