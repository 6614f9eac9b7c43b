"""`excite identify` as a user runs it."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml

from excite_cli.config.load_spec import load_spec
from excite_cli.effects.catalogue import declared_effects
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.robot.model import Robot, build_robot
from excite_cli.simulation.build import true_inertias
from tests.cli.program import SMOKE, Program
from tests.identification.synthetic import measured

CONFIG = "arm.yaml"


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(load_spec(SMOKE).robot, SMOKE.parent)


@pytest.fixture(scope="module")
def folder(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A problem that declares friction, and three measured runs."""
    folder = tmp_path_factory.mktemp("identify")
    tree = yaml.safe_load(SMOKE.read_text())["robot"]
    tree["urdf"] = str((SMOKE.parent / tree["urdf"]).resolve())
    kinds = [{"kind": "viscous_friction"}, {"kind": "coulomb_friction"}]
    (folder / CONFIG).write_text(yaml.safe_dump({"robot": tree, "effects": kinds}))
    effects = declared_effects(load_spec(folder / CONFIG).effects, robot)
    values = np.linspace(0.5, 2.0, 2 * robot.n)
    phi = true_inertias(robot, 0.2, seed=3)
    data = measured(robot, phi, effects, values, noise=0.1, seconds=8.0, seeds=(1, 2, 3))
    write_dataset(folder / "data.h5", data, {})
    return folder


def test_json_holds_what_scripts_rely_on(folder: Path, robot: Robot, excite: Program) -> None:
    answer = excite.answer("identify", folder / CONFIG, folder / "data.h5")
    first = answer["parameters"][0]
    assert {"name", "value", "std", "relative_std", "identifiable"} <= set(first)
    friction = [p for p in answer["parameters"] if "friction" in p["name"]]
    found = [p["value"] for p in friction]
    assert found == pytest.approx(np.linspace(0.5, 2.0, 2 * robot.n), rel=0.1, abs=0.05)
    error = answer["error"]
    assert set(error) >= {
        "mean_relative", "mean_relative_moving", "relative", "relative_moving", "rms", "rms_raw",
    }  # fmt: skip
    assert set(error["relative"]) == set(robot.joint_names)
    assert answer["held_out_run"] == "r3"
    assert 0 < error["mean_relative"] < 0.2


@pytest.mark.long
def test_every_output_is_written_can_be_used_and_exported_again(
    folder: Path, robot: Robot, excite: Program
) -> None:
    outputs = {"urdf": "new.urdf", "mjcf": "new.xml", "yaml": "p.yaml"}
    words = ["-o", "fit.h5", "--urdf", "new.urdf", "--mjcf", "new.xml", "--parameters", "p.yaml"]
    (excite.folder / "fit.h5").write_text("to be replaced")
    shutil.copy(folder / CONFIG, excite.folder)
    words += ["--held-out", "r1", "--overwrite"]
    run = excite.good("identify", CONFIG, folder / "data.h5", *words)
    assert "Error of the torque" in run.stdout
    assert "identifiable" in run.stdout
    with h5py.File(excite.folder / "fit.h5") as file:
        assert file.attrs["held_out_run"] == "r1"
    (excite.folder / CONFIG).unlink()
    for name, made in outputs.items():
        excite.good("export", "fit.h5", "-f", name, "-o", f"again_{made}")
        again = excite.folder / f"again_{made}"
        assert again.read_text() == (excite.folder / made).read_text()
        assert f"{made} exists" in excite.refused("export", "fit.h5", "-f", name, "-o", made)
    told = excite.refused("export", "fit.h5", "-f", "csv")
    assert "fit.h5 is a model: it cannot be exported as csv. Its formats: urdf, mjcf, y" in told
    tree = {"robot": {"urdf": str(excite.folder / "new.urdf")}}
    tree["effects"] = yaml.safe_load((excite.folder / "p.yaml").read_text())["effects"]
    (excite.folder / "again.yaml").write_text(yaml.safe_dump(tree))
    answer = excite.answer("identify", "again.yaml", folder / "data.h5")
    assert len(answer["effects"]) == 2 * robot.n
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(excite.folder / "new.xml"))
    assert (model.dof_damping > 0).all()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--held-out", "r7"), "there is no run 'r7'"),
        (("-o", "there"), "there exists already. Give another name, or replace it with"),
        (("-o", "x.h5", "--urdf", "x.h5"), "both name x.h5"),
    ],
)
def test_bad_input_gives_one_message(
    folder: Path, excite: Program, words: tuple[str, ...], message: str
) -> None:
    (excite.folder / "there").write_text("mine")
    assert message in excite.refused("identify", folder / CONFIG, folder / "data.h5", *words)
    assert [path.read_text() for path in excite.folder.iterdir()] == ["mine"]
