import pytest

from excite_cli.robot.model import Robot
from tests.base_link.stander import stander


@pytest.fixture(scope="package")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return stander(tmp_path_factory.mktemp("urdf"))
