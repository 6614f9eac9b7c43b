import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import cache
from tests.cli.program import SMOKE, Installed

__all__ = ["cache"]


@pytest.fixture
def excite(tmp_path: Path, cache: Path) -> Installed:
    """The installed program in an empty folder."""
    return Installed(tmp_path, cache)


def with_program(folder: Path, text: str) -> Path:
    """The folder with the small arm's config and a program that measures, `play.py`."""
    config = SMOKE.read_text(encoding="utf-8").replace("../data", str(SMOKE.parents[1] / "data"))
    (folder / "smoke.yaml").write_text(config, encoding="utf-8")
    (folder / "play.py").write_text(text, encoding="utf-8")
    return folder


def state_of(folder: Path) -> Any:
    """What a campaign has written down."""
    return json.loads((folder / "campaign" / "campaign.json").read_text())
