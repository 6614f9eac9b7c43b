from pathlib import Path

import pytest

from excite_cli.api.loading import load_case, load_data
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Robot

FOLDER = Path(__file__).resolve().parents[2] / "data" / "kr300"


@pytest.fixture(scope="session")
def kr300() -> tuple[Robot, Dataset]:
    """The KUKA and its log."""
    case = load_case(FOLDER / "kr300.yaml")
    return case.robot, load_data(case, FOLDER / "kr300.h5", tell=lambda note: None)
