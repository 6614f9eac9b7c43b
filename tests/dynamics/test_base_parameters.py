"""Base parameters: the right number, a mapping that holds, robust against dust, told in words."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics import base_parameters as module
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.robot.model import Robot, build_robot
from tests.robot.random_robots import random_robot

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


def test_same_robot_same_selection() -> None:
    robot = random_robot(4, joints=5)
    first, second = find_base_parameters(robot), find_base_parameters(robot)
    assert np.array_equal(first.selection, second.selection)
    assert np.array_equal(first.mapping, second.mapping)
