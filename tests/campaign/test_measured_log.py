"""A record says that a log is whole; it is about that log, byte for byte."""

from pathlib import Path

import pytest

from excite_cli.campaign.measured_log import (
    digest_of,
    is_measured,
    record_measured,
    record_of,
    same_file,
)
from excite_cli.errors import FileError


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "m_log.csv"
    path.write_text("t\n0\n")
    return path


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A log that is a folder."""
    path = tmp_path / "m_log.bag"
    path.mkdir()
    (path / "metadata.yaml").write_text("a")
    (path / "data.mcap").write_text("b")
    return path


def test_a_log_is_measured_once_that_is_recorded_until_it_changes(log: Path, bag: Path) -> None:
    for each in (log, bag):
        assert not is_measured(each)
        record_measured(each)
        assert is_measured(each)
    log.write_text("t\n1\n")
    assert not is_measured(log)
    (bag / "data.mcap").rename(bag / "other.mcap")
    assert not is_measured(bag)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"sha256": 1}', "\x00\xff"])
def test_a_damaged_record_says_nothing(log: Path, text: str) -> None:
    record_of(log).write_text(text)
    assert not is_measured(log)


def test_a_log_that_is_not_there_is_not_recorded(log: Path) -> None:
    log.unlink()
    with pytest.raises(FileError, match="cannot be read"):
        record_measured(log)
    assert not record_of(log).exists()


def test_copies_are_found_by_their_bytes(log: Path, bag: Path, tmp_path: Path) -> None:
    copy, other = tmp_path / "copy.csv", tmp_path / "other.csv"
    copy.write_bytes(log.read_bytes())
    other.write_text("t\n1\n")  # of the same size
    assert same_file(log, [other, tmp_path / "none", copy]) == copy
    assert same_file(log, [other, bag]) is None
    assert digest_of(bag) != digest_of(log)
