"""A log is told from that of another motion, of a part of one, of another speed or joint."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.campaign.same_motion import (
    compared,
    digest_of,
    is_measured,
    record_measured,
    record_of,
    same_file,
)
from excite_cli.errors import FileError

JOINTS = ("shoulder", "elbow", "wrist")


def motion(seed: int, seconds: float = 8.0, rate: float = 125.0) -> tuple[np.ndarray, np.ndarray]:
    """Three harmonics of random size per joint, from rest to rest by a window."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate)
    window = np.sin(np.pi * t / seconds) ** 2
    waves = sum(
        rng.normal(size=3) * np.sin(2 * np.pi * k * t[:, None] / seconds + rng.normal(size=3))
        for k in (1, 2, 3)
    )
    return t, window[:, None] * np.asarray(waves)


def played(seed: int, lead: float = 0.0, lag: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """What encoders say: noise, a lag of the controller, and rest before and after."""
    t, q = motion(seed)
    log = np.arange(0.0, t[-1] + 2 * lead, 1.0 / 500.0)
    at = [np.interp(log - lead - lag, t, each) for each in q.T]
    noise = 1e-3 * np.random.default_rng(seed + 100).normal(size=(len(log), 3))
    return log + 1234.5, np.column_stack(at) + noise


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("lead", "lag"), [(0.0, 0.0), (0.0, 0.05), (3.0, 0.08)])
def test_its_own_log_is_known(seed: int, lead: float, lag: float) -> None:
    found = compared(motion(seed), played(seed, lead, lag), JOINTS)
    assert found.reason == found.doubt == ""
    assert found.lag == pytest.approx(lead + lag, abs=0.03)
    assert max(found.off.values()) < 0.05


@pytest.mark.parametrize("seed", range(6))
def test_the_log_of_another_motion_is_told(seed: int) -> None:
    found = compared(motion(seed), played(seed + 50), JOINTS)
    assert "of another motion" in found.reason
    assert "allowed: 30%" in found.reason


def test_part_of_a_log_and_another_speed_are_told() -> None:
    t, q = played(1)
    half = len(t) // 2
    found = compared(motion(1), (t[:half], q[:half]), JOINTS)
    assert found.reason == "it lasts 4.0 s, and the motion 8.0 s: it is not whole"
    for part in (slice(150, None), slice(None, -150)):  # 0.3 s of 8 s late or early is whole
        assert compared(motion(1), (t[part], q[part]), JOINTS).reason == ""
    assert "another speed" in compared(motion(1), (2.0 * t, q), JOINTS).reason


def test_a_joint_that_stood_still_is_named() -> None:
    t, q = played(1)
    q[:, 1] = q[0, 1]
    reason = compared(motion(1), (t, q), JOINTS).reason
    assert all(each in reason for each in ("1 of 3 joints", "most elbow", "it stood still"))


@pytest.mark.parametrize("seed", range(4))
def test_a_joint_that_follows_badly_makes_no_other_motion(seed: int) -> None:
    t, q = played(seed)
    q[:, 2] = q[0, 2] + 0.55 * (q[:, 2] - q[0, 2])  # sticks, and goes half the way
    found = compared(motion(seed), (t, q), JOINTS)
    assert found.reason == ""
    assert "could not follow" in found.doubt
    assert "wrist by 4" in found.doubt
    assert "elbow" not in found.doubt


def test_joints_that_are_not_planned_to_move_are_not_judged() -> None:
    t, q = motion(1)
    q[:, 2] = 0.3
    log, q_log = played(1)
    q_log[:, 2] = 0.3 + 0.01 * np.sin(log)
    assert compared((t, q), (log, q_log), JOINTS).reason == ""


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
