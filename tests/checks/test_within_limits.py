"""Set-ups with which joints would be beyond their limits are no alternatives."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.checks.samples import Samples
from excite_cli.checks.set_up_search import beyond_limits
from excite_cli.checks.setup import Setup
from excite_cli.robot.model import Robot
from tests.simulation.arms import arm


@pytest.fixture(scope="module")
def robot() -> Robot:
    return arm()


def at(robot: Robot, q: np.ndarray) -> Samples:
    none = np.zeros_like(q)
    every = np.ones(q.shape, bool)
    return Samples(q, none, none, none, none[None], every, every)


def test_beyond_by_a_tenth_of_the_range_but_for_whole_turns(robot: Robot) -> None:
    upper = robot.limits.upper
    q = np.zeros((3, robot.n))
    q[0, 2] = upper[2] + 0.05 * (upper[2] - robot.limits.lower[2])
    declared = Setup.as_declared(robot)
    assert not beyond_limits(robot, at(robot, q), declared).any()
    q[:, 2] += 2 * np.pi
    assert not beyond_limits(robot, at(robot, q), declared).any()
    q[1, 2] += 1.5 * np.pi
    assert beyond_limits(robot, at(robot, q), declared).tolist() == [
        False,
        False,
        True,
        *[False] * 3,
    ]
    assert not beyond_limits(robot, at(robot, q), replace(declared, turn=0.1 * declared.turn)).any()
