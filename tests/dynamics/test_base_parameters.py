"""Base parameters: the right number, a mapping that holds, robust against dust, told in words.

Angles that are right but for decimals give the base parameters of right angles, and a note.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics import base_parameters as module
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.robot.description import load_description
from excite_cli.robot.model import Robot, build_robot
from tests.robot.random_robots import random_robot
from tests.urdf_elements import joint, link, robot_text

ARMS = tuple(f"arm_{side}_{i}_joint" for side in ("left", "right") for i in range(1, 8))


def _stack(robot: Robot, seed: int, count: int = 300) -> np.ndarray:
    y = Regressor(robot).evaluate(*robot.draw_states(count, seed))
    return y.reshape(-1, y.shape[-1])


@settings(max_examples=12, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999), joints=st.integers(1, 6), floating=st.booleans())
def test_mapping_reproduces_torques_with_the_numerical_rank(
    seed: int, joints: int, floating: bool
) -> None:
    robot = random_robot(seed, joints=joints, floating=floating)
    base = find_base_parameters(robot)
    y = _stack(robot, seed + 1)
    phi = np.random.default_rng(seed).normal(size=y.shape[1])
    tau = y @ phi
    found = y[:, base.selection] @ (base.mapping @ phi)
    assert np.allclose(found, tau, atol=1e-7 * np.abs(tau).max())
    sigma = np.linalg.svd(y / np.maximum(np.linalg.norm(y, axis=0), 1e-12), compute_uv=False)
    assert base.rank == int((sigma > 1e-9 * sigma[0]).sum())


@pytest.mark.parametrize(
    ("urdf", "joints", "expected"),
    [
        # Gautier and Khalil (1990): a six-axis arm of this kind has 36, seven axes 43.
        ("ur10", "all", 36),
        ("panda", tuple(f"panda_joint{i}" for i in range(1, 8)), 43),
        # Two upright seven-axis arms on a still torso: 2 × 43.
        ("talos", ARMS, 86),
    ],
)
def test_known_numbers(urdf: str, joints: tuple[str, ...], expected: int) -> None:
    robot = build_robot(RobotSpec(urdf=f"example-robot-data:{urdf}", joints=joints))
    base = find_base_parameters(robot)
    assert base.rank == expected
    assert base.residual < 1e-9
    assert base.gap > 1e4


def test_dust_in_the_columns_adds_no_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = build_robot(RobotSpec(urdf="example-robot-data:ur10"))
    clean = find_base_parameters(robot).rank
    exact = Regressor.evaluate

    def dusty(self: Regressor, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        y = exact(self, q, v, a)
        noise = np.random.default_rng(int(1e6 * abs(q[0, 0]))).normal(size=y.shape)
        return y + 1e-16 * noise

    monkeypatch.setattr(module.Regressor, "evaluate", dusty)
    assert find_base_parameters(robot).rank == clean


def test_words_say_what_is_grouped() -> None:
    robot = random_robot(11, joints=3, branches=False, prismatic=False)
    base = find_base_parameters(robot)
    values = dict(zip(base.names, standard_parameters(robot), strict=True))
    expected = base.mapping @ standard_parameters(robot)
    for words, value in zip(base.in_words(digits=15), expected, strict=True):
        total = 0.0
        for sign, factor, name in re.findall(r"(^|[-+] |-)([\d.e+-]+·)?(\w+\[\w+\])", words):
            size = float(factor[:-1]) if factor else 1.0
            total += (-size if "-" in sign else size) * values[name]
        assert total == pytest.approx(value, rel=1e-9, abs=1e-9)


HALF_TURN = (np.pi, 0.0, 0.0)
MOMENTS = "0.02 0.03 0.025 0.001 0.002 0"


def _condition(robot: Robot, base: BaseParameters) -> float:
    y = Regressor(robot).evaluate(*robot.draw_states(300, 5))
    return float(np.linalg.cond(y.reshape(-1, y.shape[-1])[:, base.selection]))


def _same(robot: Robot, exact: Robot) -> BaseParameters:
    """The base of `robot`, after it was found to be as good as that of `exact`."""
    base, right = find_base_parameters(robot), find_base_parameters(exact)
    assert base.rank == right.rank
    assert np.array_equal(base.selection, right.selection)
    assert _condition(robot, base) == pytest.approx(_condition(exact, right), rel=0.01)
    assert right.note == ""
    return base


@pytest.mark.parametrize("angle", [3.14, 3.1416, 3.14159265])
@pytest.mark.parametrize("urdf", ["ur10", "panda"])
def test_a_base_that_is_turned_by_nearly_half_a_turn(urdf: str, angle: float) -> None:
    spec = RobotSpec(urdf=f"example-robot-data:{urdf}", base_orientation=(angle, 0.0, 0.0))
    exact = spec.model_copy(update={"base_orientation": HALF_TURN})
    base = _same(build_robot(spec), build_robot(exact))
    assert base.tilted == (build_robot(spec).joint_names[0],)
    assert base.hidden in (2, 3)  # the third of a Panda is a matter of rounding
    assert f"show {base.hidden} more base parameters" in base.note
    robot = build_robot(spec)
    y = Regressor(robot).evaluate(*robot.draw_states(50, 3))
    assert np.abs(y @ base.silent_direction()).max() < 1e-9, "the angles as given count"


@pytest.mark.parametrize("angle", ["1.57", "1.571", "1.5708"])
def test_an_upright_axis_behind_two_rounded_turns(angle: str, tmp_path: Path) -> None:
    def robot(angle: str) -> Robot:
        turns = (f"{angle} 0 0", "-1.5707963267948966 0 0", f"{angle} 0 0")
        links = [link(f"l{k}", 2, MOMENTS, "0.1 0.05 0.2") for k in range(4)]
        joints = [
            joint(
                f"j{k}",
                (f"l{k - 1}", f"l{k}"),
                "0 0.1 0.3",
                turn=turn,
                kind="fixed" if k == 1 else "revolute",
            )
            for k, turn in enumerate(turns, start=1)
        ]
        path = tmp_path / f"{angle}.urdf"
        path.write_text(robot_text("r", *links, *joints), encoding="utf-8")
        return build_robot(RobotSpec(urdf=str(path)))

    base = _same(robot(angle), robot(repr(np.pi / 2)))
    rounded_in_the_urdf = angle == "1.5708"  # those are made right when it is read
    assert base.tilted == (() if rounded_in_the_urdf else ("j2",))


def test_the_angles_of_example_robots_with_three_decimals(tmp_path: Path) -> None:
    path = load_description("example-robot-data:panda", (), None).path
    text = Path(path).read_text(encoding="utf-8")
    rounded = re.sub(r'rpy="[^"]*"', lambda m: re.sub(r"1\.57\d*", "1.57", m.group()), text)
    assert rounded != text
    (tmp_path / "panda.urdf").write_text(rounded, encoding="utf-8")
    joints = tuple(f"panda_joint{k}" for k in range(1, 8))
    packages = (str(Path(path).parents[2]),)
    near = build_robot(
        RobotSpec(urdf=str(tmp_path / "panda.urdf"), package_dirs=packages, joints=joints)
    )
    _same(near, build_robot(RobotSpec(urdf="example-robot-data:panda", joints=joints)))


def test_a_real_tilt_counts() -> None:
    tilted = RobotSpec(urdf="example-robot-data:ur10", base_orientation=(0.01, 0.0, 0.0))
    base = find_base_parameters(build_robot(tilted))
    assert (base.rank, base.tilted) == (38, ())
