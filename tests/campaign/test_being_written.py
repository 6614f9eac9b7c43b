"""Whether somebody has a file open for writing."""

import sys
from pathlib import Path

import pytest

from excite_cli.campaign.inbox import is_being_written


@pytest.mark.skipif(sys.platform != "linux", reason="leases are of Linux")
def test_a_file_is_being_written_as_long_as_it_is_open_for_that(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    with path.open("w"):
        assert is_being_written(path)
    assert not is_being_written(path)
    with path.open("r"):
        assert not is_being_written(path)
    with path.open("a") as file:  # our own look at it was no obstacle
        assert is_being_written(path)
        file.write("x")
    assert path.read_text() == "x"


def test_where_nothing_can_be_said_it_is_not(tmp_path: Path) -> None:
    assert not is_being_written(tmp_path / "none")
    assert not is_being_written(tmp_path)
