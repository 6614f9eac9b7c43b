import pytest

from excite_cli.robot.model import Robot
from tests.simulation.arms import arm


@pytest.fixture(scope="package")
def robot() -> Robot:
    return arm()
