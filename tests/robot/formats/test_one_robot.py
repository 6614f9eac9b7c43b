"""One robot in four formats: the same base parameters and torques."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.robot.model import Robot
from tests.urdf_elements import joint, link, robot_text

LENGTHS, MASSES = (0.31, 0.27, 0.13), (3.1, 1.7, 0.6)
AXES = ("0 0 1", "0 1 0", "1 0 0")
INERTIA = (0.021, 0.017, 0.006, 0.001, -0.002, 0.0005)  # ixx, iyy, izz, ixy, ixz, iyz


def _urdf() -> str:
    parts, above, at = ['<link name="base"/>'], "base", 0.1
    moments, limits = " ".join(map(str, INERTIA)), 'lower="-1" upper="1.5" velocity="2" effort="50"'
    for k, (length, mass, axis) in enumerate(zip(LENGTHS, MASSES, AXES, strict=True)):
        parts.append(link(f"l{k}", mass, moments, f"0.01 -0.02 {length / 2}"))
        parts.append(joint(f"j{k}", (above, f"l{k}"), f"0 0 {at}", axis, limits))
        above, at = f"l{k}", length
    return robot_text("one", *parts)


def _xacro() -> str:
    """Half lengths are expressions, so that expanding is needed."""
    text = _urdf()
    for length in LENGTHS:
        text = text.replace(f"-0.02 {length / 2}", f"-0.02 ${{{length} / 2}}")
    space = 'xmlns:xacro="http://www.ros.org/wiki/xacro" name="one">'
    return text.replace('name="one">', f'{space}<xacro:property name="unused" value="1"/>')


def _mjcf() -> str:
    inside, end = "", ""
    at = 0.1
    full = " ".join(map(str, INERTIA))
    for k, (length, mass, axis) in enumerate(zip(LENGTHS, MASSES, AXES, strict=True)):
        inside += (
            f'<body name="l{k}" pos="0 0 {at}"><joint name="j{k}" axis="{axis}" range="-1 1.5"/>'
            f'<inertial pos="0.01 -0.02 {length / 2}" mass="{mass}" fullinertia="{full}"/>'
        )
        end += "</body>"
        at = length
    motors = "".join(f'<motor joint="j{k}" ctrlrange="-50 50"/>' for k in range(len(LENGTHS)))
    return (
        '<mujoco><compiler angle="radian"/><worldbody><body name="base">'
        f"{inside}{end}</body></worldbody><actuator>{motors}</actuator></mujoco>"
    )


def _sdf(form: str) -> str:
    """Links stand askew of their joints; of version 1.4 axes are given in the model's frame."""
    turn = pin.rpy.rpyToMatrix(0.3, -0.2, 0.5)
    askew, at, parts, above = pin.SE3(turn, np.array([0.05, 0.02, -0.03])), 0.1, [], "base"
    names = dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), INERTIA, strict=True))
    inertia = "".join(f"<{key}>{value}</{key}>" for key, value in names.items())
    for k, (length, mass, axis) in enumerate(zip(LENGTHS, MASSES, AXES, strict=True)):
        here = pin.SE3(np.eye(3), np.array([0.0, 0.0, at]))
        centre = pin.SE3(np.eye(3), np.array([0.01, -0.02, length / 2]))
        parts.append(
            f'<link name="l{k}">{_pose(here * askew)}<inertial>{_pose(askew.inverse() * centre)}'
            f"<mass>{mass}</mass><inertia>{inertia}</inertia></inertial></link>"
            f'<joint name="j{k}" type="revolute"><parent>{above}</parent><child>l{k}</child>'
            f"{_pose(askew.inverse())}<axis><xyz>{axis}</xyz><limit><lower>-1</lower>"
            "<upper>1.5</upper><velocity>2</velocity><effort>50</effort></limit></axis></joint>"
        )
        above, at = f"l{k}", at + length
    inside = "".join(parts)
    return f'<sdf version="{form}"><model name="one"><link name="base"/>{inside}</model></sdf>'


def _pose(place: pin.SE3) -> str:
    figures = [*place.translation, *pin.rpy.matrixToRpy(place.rotation)]
    return f"<pose>{' '.join(repr(float(x)) for x in figures)}</pose>"


def _robot(folder: Path, name: str, text: str) -> Robot:
    (folder / name).write_text(text)
    config = folder / f"{name}.yaml"
    # MJCF has no limits of speed; those states are drawn from decide which columns are chosen.
    speeds = ", ".join(f"j{k}: {{velocity: 2}}" for k in range(len(LENGTHS)))
    config.write_text(f"robot: {{urdf: {name}, limits: {{{speeds}}}}}\n")
    return load_problem(config).robot


@pytest.mark.long
def test_base_parameters_and_torques_agree(tmp_path: Path) -> None:
    texts = {"one.urdf": _urdf(), "one.xacro": _xacro(), "one.xml": _mjcf()}
    texts |= {"one.sdf": _sdf("1.9"), "older.sdf": _sdf("1.4")}
    robots = [_robot(tmp_path, name, text) for name, text in texts.items()]
    states = robots[0].draw_states(60, 1)
    first = find_base_parameters(robots[0])
    torques = Regressor(robots[0]).evaluate(*states) @ standard_parameters(robots[0])
    for other in robots[1:]:
        base = find_base_parameters(other)
        assert base.rank == first.rank
        np.testing.assert_array_equal(base.selection, first.selection)
        np.testing.assert_allclose(
            base.mapping @ standard_parameters(other),
            first.mapping @ standard_parameters(robots[0]),
            atol=1e-9,
        )
        found = Regressor(other).evaluate(*states) @ standard_parameters(other)
        np.testing.assert_allclose(found, torques, atol=1e-9)
        np.testing.assert_allclose(other.limits.upper, robots[0].limits.upper)
        np.testing.assert_allclose(other.limits.effort, robots[0].limits.effort)
