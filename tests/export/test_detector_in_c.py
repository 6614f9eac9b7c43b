"""The detector in C says what the thresholds say, on series that its own test does not know."""

import ctypes
from pathlib import Path

import numpy as np
import pytest

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.export.c_model import c_model
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Robot, build_robot
from excite_cli.scoring.thresholds import Residual, Thresholds
from tests.export.test_c_model import COMPILERS, UR10, compiled


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(UR10)


def thresholds(robot: Robot, seed: int) -> Thresholds:
    rng = np.random.default_rng(seed)
    rows = rng.uniform(0.01, 1.0, (robot.n, 4))
    return Thresholds(robot.joint_names, rows, rng.uniform(3.0, 9.0, robot.n), 2.0, 0.03)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_it_says_what_the_thresholds_say(compiler: str, robot: Robot, tmp_path: Path) -> None:
    given = thresholds(robot, 3)
    model = IdentifiedModel(standard_parameters(robot))
    library = compiled(c_model(robot, model, thresholds=given).text, tmp_path, compiler)
    library.excite_detector_self_test.restype = ctypes.c_double
    assert library.excite_detector_self_test() < 1e-12
    rng, step = np.random.default_rng(8), 0.004
    residual = 0.5 * np.cumsum(rng.normal(0.0, 0.4, (300, robot.n)), axis=0)
    speed, load = rng.normal(0.0, 0.1, (2, 300, robot.n))
    expected = given.beyond(Residual(residual, speed, load, step))
    state = (ctypes.c_double * (2 * robot.n + 2))()
    library.excite_detector_begin(state, ctypes.c_double(step))
    beyond = np.zeros(robot.n)
    for k in range(300):
        rows = [np.ascontiguousarray(x[k]) for x in (residual, speed, load)]
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (*rows, beyond)]
        said = library.excite_detect(state, *pointers)
        assert np.abs(beyond) == pytest.approx(expected[k], rel=1e-12)
        assert said == int((expected[k] > 1.0).any())
    spoken = (expected > 1.0).any(axis=1).mean()
    assert 0.05 < spoken < 0.95


def test_without_thresholds_there_is_none(robot: Robot) -> None:
    text = c_model(robot, IdentifiedModel(standard_parameters(robot))).text
    assert "excite_detector_begin" not in text
    assert "@" not in text.replace("(at)", "")
