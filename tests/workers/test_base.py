"""Messages name what lies on disk; it comes back as it was, from its own process or another."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from excite_cli.out_of_core import Spool, attached, forget, reference_to
from excite_cli.workers.base import POSSIBLE, packed
from excite_cli.workers.processes import Processes
from tests.workers import work

pytestmark = pytest.mark.skipif(not POSSIBLE, reason="files of other processes need /proc")


def test_an_array_on_disk_is_named_and_not_copied() -> None:
    values = np.random.default_rng(1).normal(size=(400, 30, 3))
    kept = Spool(room=0).keep(values)
    for given in (kept, kept[7:300, 4], kept[:, ::7, 1], kept[5, 2, 1:]):
        message = packed(given)
        if given.nbytes >= 4096:
            assert len(message) < 1000
        found = pickle.loads(message)
        forget()
        assert np.array_equal(found, values if given is kept else given)
        assert found.dtype == given.dtype


def test_what_lies_in_memory_goes_to_a_file_only_if_it_is_large() -> None:
    small, large = np.arange(1000.0), np.arange(100_000.0)
    spool = Spool(room=0)
    message = packed((small, large), spool)
    assert small.nbytes < len(message) < large.nbytes / 10
    assert reference_to(large) is None
    for given, found in zip((small, large), pickle.loads(message), strict=True):
        assert np.array_equal(given, found)


def test_a_repeated_value_travels_as_one() -> None:
    given = np.broadcast_to(2.5, (30_000, 7, 4))
    for each in (given, given[5:, 1]):
        message = packed(each, Spool(room=0))
        assert len(message) < 1000
        assert np.array_equal(pickle.loads(message), each)


@pytest.mark.long
def test_large_results_of_a_process_outlive_it_and_parts_of_what_it_was_given_come_back() -> None:
    """The file of what is given is open there only while the task is done."""
    factors = (1.0, 2.0, 3.0)
    with Processes(2) as workers:
        found = workers.map(work.table, 100_000, factors)
        halves = workers.map(work.doubled_half, None, found)
    for factor, table, half in zip(factors, found, halves, strict=True):
        assert np.array_equal(table, factor * np.arange(100_000.0))
        assert np.array_equal(half[0], 2.0 * table)
        assert np.array_equal(half[1], table[50_000:])


def test_a_file_that_is_gone_is_an_error(tmp_path: Path) -> None:
    reference = reference_to(Spool(room=0).keep(np.arange(1000.0)))
    assert reference is not None
    with pytest.raises(FileNotFoundError):
        attached(reference)
