"""What the ground can give: statics by hand, what is asked of it, and what cannot be asked."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.constraints_spec import ConstraintsSpec, ContactSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.whole_robot import CenterOfMass
from excite_cli.errors import ConfigError
from excite_cli.robot.model import Array, Robot, build_robot
from tests.robot.random_robots import random_robot
from tests.urdf_elements import joint, link, robot_text

SQUARE = ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))
SPEC = ContactSpec(vertices=SQUARE, margin=0.1, friction=0.4, torsion=0.1, min_load=20.0)


def built(robot: Robot, spec: ContactSpec = SPEC) -> dict[str, Constraint]:
    found = build_constraints(ConstraintsSpec(joint_limits=None, contact=spec), robot)
    return {constraint.name: constraint for constraint in found}


def at(robot: Robot, q: Array, a: Array | None = None) -> States:
    still = np.zeros_like(q)
    return States(BatchKinematics(robot), q, still, still if a is None else a)


@pytest.mark.parametrize("floating", [False, True])
def test_at_rest_the_zero_moment_point_is_below_the_centre_of_mass(floating: bool) -> None:
    robot = random_robot(1, joints=4, floating=floating)
    states = at(robot, robot.draw_states(6, 0)[0])
    mass = CenterOfMass(robot)
    x, y = mass.position(states)[:, :2].T
    expected = 0.4 - np.maximum(np.abs(x), np.abs(y))
    constraints = built(robot)
    assert np.allclose(constraints["zmp"].margins(states).min(axis=1), expected)
    contact = constraints["contact"]
    weight = 9.81 * mass.total_mass
    left = dict(zip(contact.labels, contact.margins(states).T, strict=True))
    assert np.allclose(left.pop("load"), weight - 20.0)
    for label, margin in left.items():
        assert np.allclose(margin, (0.1 if "torsion" in label else 0.4) * weight), label
        assert contact.unit_of(contact.labels.index(label)) == (
            "N·m" if "torsion" in label else "N"
        )


def slider(folder: Path, axis: str, height: float) -> Robot:
    path = folder / "slider.urdf"
    limits = 'lower="-1" upper="1" velocity="2" effort="100"'
    slide = joint("slide", ("foot", "block"), f"0 0 {height}", axis, limits, "prismatic")
    text = robot_text("slider", link("foot", 30), link("block", 10), slide)
    path.write_text(text, encoding="utf-8")
    return build_robot(RobotSpec(urdf=str(path)))


def test_a_block_that_is_pushed_sideways_moves_the_zero_moment_point(tmp_path: Path) -> None:
    robot = slider(tmp_path, "1 0 0", 1.2)
    states = at(robot, np.array([[0.2]]), np.array([[3.0]]))
    spec = SPEC.model_copy(update={"height": -0.3, "margin": 0.0})
    constraints = built(robot, spec)
    weight = 40 * 9.81
    # 10 kg at x = 0.2 m, 1.5 m above the ground, pushed with 30 N.
    x = (10 * 9.81 * 0.2 - 30 * 1.5) / weight
    edges = constraints["zmp"]
    towards = dict(zip(edges.labels, edges.margins(states)[0], strict=True))
    assert np.isclose(towards["towards 0°"], 0.5 - x)
    assert np.isclose(towards["towards 180°"], 0.5 + x)
    contact = constraints["contact"]
    left = dict(zip(contact.labels, contact.margins(states)[0], strict=True))
    assert np.isclose(left["friction +x"], 0.4 * weight - 30)
    assert np.isclose(left["friction -x"], 0.4 * weight + 30)


def test_a_block_that_falls_takes_the_load_off(tmp_path: Path) -> None:
    robot = slider(tmp_path, "0 0 1", 1.0)
    contact = built(robot)["contact"]
    for push, load in ((-9.81, 30 * 9.81), (-40.0, 40 * 9.81 - 400.0)):
        states = at(robot, np.zeros((1, 1)), np.array([[push]]))
        left = dict(zip(contact.labels, contact.margins(states)[0], strict=True))
        assert np.isclose(left["load"], load - 20.0)
    zmp = built(robot)["zmp"]
    assert np.all(np.isfinite(zmp.margins(states)))


def test_torsion_is_taken_about_the_middle_of_the_polygon() -> None:
    robot = random_robot(3, joints=3)
    moved = tuple((x + 2.0, y - 1.0) for x, y in SQUARE)
    states = States(BatchKinematics(robot), *robot.draw_states(5, 1))
    contact = built(robot, SPEC.model_copy(update={"vertices": moved}))["contact"]
    wrench = contact.ground.wrench.regressor(states) @ contact.uncertainty.pieces[0].center
    about = wrench[:, 5] - (2.0 * wrench[:, 1] + 1.0 * wrench[:, 0])
    column = contact.labels.index("torsion +")
    assert np.allclose(contact.margins(states)[:, column], 0.1 * wrench[:, 2] - about)
    # Only what is asked for is checked.
    only_load = built(robot, ContactSpec(min_load=1.0))
    assert list(only_load) == ["contact"]
    assert only_load["contact"].labels == ("load",)
    assert len(built(robot, ContactSpec(friction=0.3))["contact"].labels) == 5


def test_what_has_no_ground_or_no_room_is_refused() -> None:
    hung = RobotSpec(urdf="example-robot-data:ur10", gravity=(0.0, 0.0, 9.81))
    with pytest.raises(ConfigError, match="gravity does not press this robot on the ground"):
        built(build_robot(hung))
    narrow = SPEC.model_copy(update={"margin": 0.6})
    with pytest.raises(ConfigError, match=r"constraints.contact: a margin of 0.6 m leaves nothing"):
        built(random_robot(1, joints=2), narrow)
