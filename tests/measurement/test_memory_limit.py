"""The limit of memory: restored by whoever leaves last, enough for what is allowed."""

import threading
from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.measurement import hdf5_reader, memory_limit
from excite_cli.measurement.memory_limit import address_space, limited_memory
from tests.measurement.recordings import JOINTS, read, recorded, refused

resource = pytest.importorskip("resource")
if address_space() is None:
    pytest.skip("no limit of memory on this system", allow_module_level=True)


def limit() -> int:
    return int(resource.getrlimit(resource.RLIMIT_AS)[0])


def test_threads_that_overlap_leave_the_limit_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x")
    before, entered, left = limit(), threading.Event(), threading.Event()

    def second() -> None:
        with limited_memory(path):
            entered.set()
            left.wait(10)

    thread = threading.Thread(target=second)
    with limited_memory(path):
        thread.start()
        entered.wait(10)
        inside = limit()
    assert inside != before
    assert limit() == inside  # the second still reads
    left.set()
    thread.join()
    assert limit() == before


def packed(path: Path) -> Path:
    """A recording with much that never changes beside it: 42 MB in 1 MB."""
    run = recorded(seconds=100.0)
    idle = np.zeros((len(run.t), 260))
    with h5py.File(path, "w") as file:
        for name, array in {"t": run.t, "q": run.q, "tau": run.tau, "idle": idle}.items():
            file.create_dataset(name, data=array, compression="gzip")
        file.attrs["joint_names"] = list(JOINTS)
    return path


def test_a_log_that_unpacks_to_much_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that `check_unpacked` allows, also where it is more than the file's size tells."""
    monkeypatch.setattr(memory_limit, "_LEAST", 2**20)
    path = packed(tmp_path / "log.h5")
    assert 30 * path.stat().st_size < 20_000 * 267 * 8 < 50 * path.stat().st_size
    assert len(read(path).runs[0].t) == 20_000


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 39.7 MiB for an array"),
        OSError("Can't synchronously read data (memory allocation failed for chunk)"),
    ],
    ids=["numpy", "hdf5"],
)
def test_short_memory_is_not_called_damage(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*args: object) -> None:
        raise error

    monkeypatch.setattr(hdf5_reader, "_values", fails)
    refused(packed(tmp_path / "log.h5"), "not enough memory")
