"""The whole mass from base parameters, against Pinocchio's sum over all bodies."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.config.data_spec import IdentificationSpec, TotalMassSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.errors import ConfigError
from excite_cli.identification.torque_scale import knowledge_of, total_mass_row, weighed
from excite_cli.robot.model import build_measured_robot
from tests.base_link.stander import stander

LOCKED = ("left_shoulder", "left_elbow", "right_shoulder")


@pytest.mark.parametrize(
    "more",
    [{"rows": ("base",)}, {"rows": ("base", "joints")}, {"rows": ("base",), "joints": LOCKED}],
)
def test_the_mass_of_all_bodies_is_a_sum_of_base_parameters(
    tmp_path: Path, more: dict[str, tuple[str, ...]]
) -> None:
    """Of the URDF, a locked elbow with it, and of any other masses."""
    robot = stander(tmp_path, **more)
    base = find_base_parameters(robot)
    w, phi = total_mass_row(robot, base), standard_parameters(robot)
    assert w @ base.mapping @ phi == pytest.approx(pin.computeTotalMass(robot.model))
    assert w @ base.mapping @ phi == pytest.approx(25.0 + 2 * 3.9)
    phi[10 * robot.massless :] = np.random.default_rng(2).normal(size=phi.size)[
        10 * robot.massless :
    ]
    assert w @ base.mapping @ phi == pytest.approx(phi[10 * robot.massless :: 10].sum())


@pytest.mark.parametrize(
    "more", [{"base": "fixed", "rows": ("joints",)}, {"base": "floating", "rows": ("joints",)}]
)
def test_a_robot_that_does_not_show_its_mass_is_told_to_weigh_a_payload(
    tmp_path: Path, more: dict[str, object]
) -> None:
    robot = stander(tmp_path, **more)
    spec = IdentificationSpec(total_mass=TotalMassSpec(mass=30.0))
    message = r"identification\.total_mass: .*robot\.base: floating.*identification\.known_payload"
    for known in (weighed, knowledge_of):
        with pytest.raises(ConfigError, match=message):
            known(spec, (), robot, find_base_parameters(robot))


def test_what_stands_still_below_an_arm_is_of_its_mass_and_does_not_show(tmp_path: Path) -> None:
    """A lift shows all that it lifts, and nothing of its column."""
    body = '<inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    path = tmp_path / "lift.urdf"
    path.write_text(
        f'<robot name="lift"><link name="column">{body}</inertial></link>'
        f'<link name="load">{body}</inertial></link><joint name="lift" type="prismatic">'
        '<parent link="column"/><child link="load"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="99"/></joint></robot>',
        encoding="utf-8",
    )
    robot = build_measured_robot(RobotSpec(urdf=str(path)))
    with pytest.raises(ConfigError, match=r"the whole mass of this robot does not show"):
        total_mass_row(robot, find_base_parameters(robot))


@pytest.mark.parametrize(("std", "believed"), [(0.5, 0.5), (0.0, 0.003)])
def test_it_is_known_by_its_deviation_but_no_better_than_scales_are(
    tmp_path: Path, std: float, believed: float
) -> None:
    robot = stander(tmp_path)
    base = find_base_parameters(robot)
    spec = IdentificationSpec(total_mass=TotalMassSpec(mass=30.0, std=std))
    known = weighed(spec, (), robot, base)
    row = total_mass_row(robot, base)
    x = row / (row @ row)  # a robot of 1 kg
    assert known.rows @ (31.0 * x) - known.target == pytest.approx([1.0 / believed])
    gains = knowledge_of(spec, (), robot, base).effects
    assert [each.kind for each in gains] == ["wrench_gain"] + ["torque_gain"] * 4
