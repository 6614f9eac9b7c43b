from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import declared_effects, urdf_friction
from excite_cli.errors import RobotError
from excite_cli.export.urdf import ModelText, updated_urdf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Robot, build_robot
from excite_cli.simulation.build import true_inertias
from tests.robot.coupled_robots import CLAW, HAND, written
from tests.robot.random_robots import random_robot

PANDA = RobotSpec(urdf="example-robot-data:panda")
ARM = tuple(f"arm_left_{k}_joint" for k in range(1, 8))
TALOS = RobotSpec(urdf="example-robot-data:talos", joints=ARM, posture={"gripper_left_joint": -0.3})
HOISTED = TALOS.model_copy(update={"base": "floating", "rows": ("base", "joints")})


def reloaded(spec: RobotSpec, text: str, folder: Path) -> Robot:
    path = folder / "identified.urdf"
    path.write_text(text, encoding="utf-8")
    return build_robot(spec.model_copy(update={"urdf": str(path)}))


@pytest.mark.parametrize("spec", [PANDA, TALOS, HOISTED], ids=["panda", "talos", "hoisted"])
def test_loading_it_again_gives_the_parameters(spec: RobotSpec, tmp_path: Path) -> None:
    robot = build_robot(spec)
    phi = true_inertias(robot, 0.3, seed=2)
    again = reloaded(spec, updated_urdf(robot, IdentifiedModel(phi)).text, tmp_path)
    assert again.joint_names == robot.joint_names
    scale = np.abs(phi).max()
    assert np.abs(standard_parameters(again) - phi).max() < 1e-9 * scale
    assert np.abs(standard_parameters(robot) - phi).max() > 1e-3 * scale


@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_links_of_joints_that_follow_get_their_own(parts: tuple, tmp_path: Path) -> None:
    spec = RobotSpec(urdf=written(tmp_path, parts))
    robot = build_robot(spec)
    phi = true_inertias(robot, 0.3, seed=2)
    effects = declared_effects((EffectSpec(kind="viscous_friction"),), robot)
    made = updated_urdf(robot, IdentifiedModel(phi, effects, np.array([1.0, 2.0, 3.0])))
    again = reloaded(spec, made.text, tmp_path)
    assert again.followers == robot.followers
    assert standard_parameters(again) == pytest.approx(phi, abs=1e-12)
    assert made.notes == ()
    found, sizes = urdf_friction(again)
    assert [effect.joints for effect in found] == [(0,), (1,), (2,)]
    assert sizes == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", range(3))
def test_random_trees(seed: int, tmp_path: Path) -> None:
    robot = random_robot(seed, joints=5, folder=tmp_path)
    phi = true_inertias(robot, 0.3, seed=2)
    spec = RobotSpec(urdf="", base_orientation=robot.base_orientation)
    again = reloaded(spec, updated_urdf(robot, IdentifiedModel(phi)).text, tmp_path)
    assert standard_parameters(again) == pytest.approx(phi, abs=1e-12)


def test_friction_goes_to_dynamics_and_the_rest_is_told(tmp_path: Path) -> None:
    robot = build_robot(PANDA)
    kinds = ("viscous_friction", "coulomb_friction", "spring")
    specs = tuple(EffectSpec(kind=kind, joints=("panda_joint2",)) for kind in kinds)
    effects = declared_effects(specs, robot)
    values = np.array([1.5, 0.25, 10.0, 1.0])
    cad = standard_parameters(robot)
    exported = updated_urdf(robot, IdentifiedModel(cad, effects, values))
    again = reloaded(PANDA, exported.text, tmp_path)
    assert again.model.damping[1] == 1.5
    assert again.model.friction[1] == 0.25
    assert again.model.damping[0] == 0.0  # the URDF's own was not part of the fitted model
    assert any("spring at panda_joint2" in note for note in exported.notes)
    assert standard_parameters(again) == pytest.approx(cad, abs=1e-12)


def test_the_rest_of_the_file_is_kept(tmp_path: Path) -> None:
    robot = random_robot(1, joints=3, folder=tmp_path)
    path = robot.description.path
    path.write_text(path.read_text().replace("</robot>", "<!-- mine --><gazebo>x</gazebo></robot>"))
    robot = build_robot(RobotSpec(urdf=str(path)))
    phi = true_inertias(robot, 0.3, seed=2)
    text = updated_urdf(robot, IdentifiedModel(phi)).text
    assert "<!-- mine -->" in text
    assert "<gazebo>x</gazebo>" in text
    assert text.count("<joint ") == path.read_text().count("<joint ")


def test_bodies_of_several_links_are_told(tmp_path: Path) -> None:
    """A lighter one takes all of it when its first link alone cannot."""
    robot = build_robot(TALOS)

    def exported(factor: float) -> tuple[np.ndarray, ModelText]:
        phi = standard_parameters(robot).copy()
        phi[-10:] *= factor
        return phi, updated_urdf(robot, IdentifiedModel(phi))

    _, heavier = exported(1.01)
    assert len(heavier.notes) == 1
    assert "gripper_left_base_link" in heavier.notes[0]
    assert "how it is shared among them does not show" in heavier.notes[0]
    phi, lighter = exported(0.05)
    assert "have lost theirs" in lighter.notes[0]
    again = reloaded(TALOS, lighter.text, tmp_path)
    assert standard_parameters(again) == pytest.approx(phi, abs=1e-12)


def test_negative_mass_is_refused() -> None:
    robot = build_robot(PANDA)
    phi = standard_parameters(robot).copy()
    phi[10] = -1.0
    with pytest.raises(RobotError, match=r"panda_link2.*-1 kg.*consistent: true"):
        updated_urdf(robot, IdentifiedModel(phi))
