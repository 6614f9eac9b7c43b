"""Arrays on disk: the same values, memory given back, files that leave nothing behind."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import random_array

from excite_cli.errors import FileError
from excite_cli.out_of_core import Spool, forget, room_of_spools


def resident() -> int:
    """Bytes of this process that are in memory."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def test_the_first_arrays_stay_and_the_others_come_back_from_disk() -> None:
    rng, spool = np.random.default_rng(1), Spool(room=1000)
    first = rng.normal(size=(10, 10))
    assert spool.keep(first) is first
    given = [
        rng.normal(size=(300, 7)), rng.normal(size=(70, 40)).T, rng.normal(size=(900, 8))[:, ::3],
        rng.random(5000) > 0.5, np.arange(600, dtype=np.uint64), np.zeros((0, 3)),
    ]  # fmt: skip
    kept = [spool.keep(each) for each in given]
    forget()
    for own, found in zip(given, kept, strict=True):
        assert found is not own or not own.size
        assert found.dtype == own.dtype
        assert np.array_equal(found, own)
    with pytest.raises(ValueError, match="read-only"):
        kept[0][0, 0] = 1.0
    small = rng.normal(size=(5, 7))
    assert spool.keep(small) is small


def test_what_is_repeated_takes_no_room() -> None:
    zeros = np.broadcast_to(0.0, (10_000, 1_000))
    assert Spool(room=0).keep(zeros) is zeros


def test_sparse_rows_multiply_as_before() -> None:
    rows = random_array((60, 200), density=0.1, format="csr", rng=np.random.default_rng(2))
    columns = np.random.default_rng(3).normal(size=(200, 4))
    kept = Spool(room=0).keep_rows(rows)
    assert np.array_equal(kept @ columns, rows @ columns)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux's /proc")
def test_memory_is_given_back() -> None:
    spool = Spool(room=0)
    kept = [spool.keep(np.full(2_000_000, float(k))) for k in range(12)]
    forget()
    before = resident()
    assert sum(each[0] + each[-1] for each in kept) == 2 * sum(range(12))
    assert sum(float(each.sum()) for each in kept) == 2_000_000 * sum(range(12))
    assert resident() - before > 150e6
    forget()
    assert resident() - before < 20e6


def test_the_room_of_spools_can_be_said_for_a_while() -> None:
    values = np.ones(1000)
    with room_of_spools(0):
        assert Spool().keep(values) is not values
        assert Spool(room=10_000).keep(values) is values
    assert Spool().keep(values) is values


def test_no_file_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    kept = Spool(room=0).keep(np.ones(1000))
    assert not list(tmp_path.iterdir())
    assert kept.sum() == 1000


def test_a_folder_without_room_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path / "absent"))
    with pytest.raises(FileError, match=r"temporary files in .*absent.*TMPDIR"):
        Spool(room=0).keep(np.ones(1000))
