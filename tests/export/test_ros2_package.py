"""The ROS 2 package: compiled against a stand-in of its interface, loaded and called; refusals."""

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.exporting import export_file
from excite_cli.api.model import Model
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ConfigError, FileError
from excite_cli.export.c_model import c_model
from excite_cli.export.ros2_package import is_package, package_name, ros2_package
from excite_cli.identification.identified_model import IdentifiedModel
from tests.api.conftest import Loop
from tests.api.conftest import loop as loop
from tests.export.test_c_model import COMPILERS, of_ur10
from tests.export.test_std_in_c import stored

STAND_IN = Path(__file__).parent / "ros2_stand_in"
STRICT = ["-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fPIC"]
KINDS = ["armature", "viscous_friction", "coulomb_friction", "spring", "payload"]


def answers(folder: Path, build: Path, *states: np.ndarray) -> tuple[list[np.ndarray], str]:
    """Inertia matrix, Coriolis, gravity and friction vectors, torques of the compiled package."""
    compiler = next((c for c in ("g++", "clang++", "c++") if shutil.which(c)), None)
    if compiler is None:
        pytest.skip("no C++ compiler: a plug-in cannot be compiled")
    own, n = [compiler, "-std=c++17", *STRICT, f"-I{STAND_IN}"], len(states[0])
    model, library, driver = build / "model.o", build / "libsolver.so", build / "driver"
    for command in (
        [COMPILERS[0], "-std=c99", *STRICT, "-c", folder / "model.c", "-o", model],
        [*own, "-shared", folder / "solver.cpp", model, "-o", library, "-lm"],
        [*own, STAND_IN / "driver.cpp", "-o", driver, "-ldl"],
    ):
        subprocess.run(command, check=True)
    numbers = [repr(float(x)) for x in np.concatenate(states)]
    ran = subprocess.run(
        [driver, library, str(n), *numbers], check=True, capture_output=True, text=True
    )
    found = np.split(np.array(ran.stdout.split(), dtype=float).reshape(-1, n), range(n, n + 4))
    return [found[0], *(x[0] for x in found[1:])], ran.stderr


def assert_says_what_python_says(model: Model, folder: Path, build: Path) -> str:
    q, v, a = (x[0] for x in model.made.robot.draw_states(1, seed=6))
    still, n = np.zeros_like(q), len(q)
    gravity = model.torque(q, still, still)
    inertia = np.stack([model.torque(q, still, unit) - gravity for unit in np.eye(n)], axis=1)
    friction = model.friction(still, v, still)
    rest = model.torque(q, v, still) - gravity - friction
    expected = [inertia, rest, gravity, friction, model.torque(q, v, a)]
    found, said = answers(folder, build, q, v, a)
    for x, y in zip(found, expected, strict=True):
        assert x == pytest.approx(y, rel=1e-9, abs=1e-9 * np.abs(expected[-1]).max())
    return said


def written(files: dict[str, str], folder: Path) -> Path:
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.mark.long
def test_it_says_what_python_says_of_bodies_rotors_springs_and_friction(tmp_path: Path) -> None:
    made = stored(*of_ur10(KINDS))
    robot = made.robot
    package = ros2_package(robot, made.model, c_model(robot, made.model), "arm")
    folder = written(dict(package.files), tmp_path / "arm")
    said = assert_says_what_python_says(Model(made), folder, tmp_path)
    assert said.startswith("arm: 5 joints are given. Give 6, in this order: shoulder_pan_joint, ")
    q, v, a = robot.draw_states(1, seed=6)
    found, _ = answers(folder, tmp_path, q[0], v[0], a[0])
    assert found[0] == pytest.approx(found[0].T)
    whole = found[0] @ a[0] + found[1] + found[2] + found[3]
    assert whole == pytest.approx(found[4], rel=1e-9, abs=1e-9)
    phi, still = made.model.phi + made.model.carried(robot), np.zeros_like(v)
    pure = RigidBody(robot, phi, q, v, still).load - RigidBody(robot, phi, q, still, still).load
    assert found[1] == pytest.approx(pure[0], rel=1e-9, abs=1e-9)


def test_friction_by_load_is_with_coriolis_and_the_user_hears_of_it(tmp_path: Path) -> None:
    robot, model = of_ur10(["load_dependent_friction", "coulomb_friction", "dahl_friction"])
    package = ros2_package(robot, model, c_model(robot, model), "arm")
    assert re.search(r"getFrictionVector .*: load_dependent_friction at", package.notes[1])
    assert package.notes[2].startswith("as at the first instant of a series: dahl_friction")
    left = model.without(tuple(e for e in model.effects if e.over_time))
    package = ros2_package(robot, left, c_model(robot, left), "arm")
    folder = written(dict(package.files), tmp_path / "arm")
    assert_says_what_python_says(Model(stored(robot, left)), folder, tmp_path)


def test_columns_of_a_log_are_refused() -> None:
    robot, model = of_ur10(["covariate_friction"])
    with pytest.raises(ConfigError, match=r"follows the column 'temp' of the log"):
        ros2_package(robot, model, c_model(robot, model), "arm")


def test_names_are_those_of_packages_and_hostile_ones_are_inert(tmp_path: Path) -> None:
    found = [package_name(x) for x in ("UR10 (left)-Arm", "7dof", "関節", "arm__x", "int")]
    assert found == ["ur10_left_arm", "robot_7dof", "robot", "arm_x", "int"]
    robot, model = of_ur10(["spring"])
    names = ('a"; #error', "*/ \\", "</name>&", "new\nline", "関", "@N@")
    robot = replace(robot, name='"<&>@NAME@\\', joint_names=names)
    package = ros2_package(robot, model, c_model(robot, model), "int")
    for each in ("package.xml", "plugin.xml"):
        ET.fromstring(package.files[each])
    folder = written(dict(package.files), tmp_path / "int")
    states = robot.draw_states(1, seed=6)
    said = answers(folder, tmp_path, *(x[0] for x in states))[1]
    assert "in this order: a_; #error, */ _, </name>&, new_line, _, @N@." in said


def test_the_file_of_a_fit_becomes_a_package(loop: Loop, tmp_path: Path) -> None:
    heard: list[str] = []
    to = tmp_path / "Small-Arm"
    export_file(loop.fit, "ros2-package", to, tell=lambda note: heard.append(note.text))
    assert sorted(each.name for each in to.iterdir()) == [
        "CMakeLists.txt", "model.c", "package.xml", "plugin.xml", "solver.cpp",
    ]  # fmt: skip
    assert any("colcon build; the plug-in is small_arm/Solver" in text for text in heard)
    root = ET.parse(to / "package.xml").getroot()
    plugin = ET.parse(to / "plugin.xml").getroot()
    assert root.findtext("name") == plugin.get("path") == "small_arm"
    assert "project(small_arm " in (to / "CMakeLists.txt").read_text()
    assert "int excite_std" in (to / "model.c").read_text()
    assert_says_what_python_says(Model.load(loop.fit), to, tmp_path)


def test_only_a_package_is_replaced_and_only_if_one_says_so(loop: Loop, tmp_path: Path) -> None:
    to = tmp_path / "arm"
    export_file(loop.fit, "ros2-package", to)
    (to / "model.c").write_text("old")
    with pytest.raises(FileError, match=r"exists already. Give another name, or replace it with"):
        export_file(loop.fit, "ros2-package", to)
    export_file(loop.fit, "ros2-package", to, overwrite=True)
    assert (to / "model.c").read_text() != "old"
    (to / "my_launch.py").touch()
    assert not is_package(to)
    with pytest.raises(FileError, match=r"exists already. Give another name.$"):
        export_file(loop.fit, "ros2-package", to, overwrite=True)
    assert (to / "my_launch.py").exists()
    with pytest.raises(FileError, match=r"is a folder. Give a file name"):
        export_file(loop.fit, "c", to, overwrite=True)
    assert [each.name for each in tmp_path.iterdir()] == ["arm"]


def test_of_straight_effects_there_is_nothing_to_say(tmp_path: Path) -> None:
    robot, model = of_ur10(["spring"])
    made = stored(robot, IdentifiedModel(model.phi, (kind_named("armature")((0,)),), np.ones(1)))
    package = ros2_package(robot, made.model, c_model(robot, made.model), "arm")
    assert package.notes == ("build it with colcon build; the plug-in is arm/Solver",)
    folder = written(dict(package.files), tmp_path / "arm")
    assert_says_what_python_says(Model(made), folder, tmp_path)
