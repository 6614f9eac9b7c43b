from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"


@pytest.fixture(scope="session")
def kr300() -> Path:
    """Folder of the KUKA's log."""
    folder = DATA / "kr300"
    if not (folder / "kr300.h5").is_file():
        pytest.skip(f"the real logs are not at {folder}")
    return folder
