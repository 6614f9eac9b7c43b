from pathlib import Path

import pytest

from tests.cli.conftest import cache
from tests.cli.program import Installed

__all__ = ["cache"]


@pytest.fixture
def excite(tmp_path: Path, cache: Path) -> Installed:
    """The installed program in an empty folder."""
    return Installed(tmp_path, cache)
