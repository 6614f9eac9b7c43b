from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[2] / "data"


@pytest.fixture(scope="session")
def kr300() -> Path:
    """Folder of the KUKA's log."""
    return DATA / "kr300"
