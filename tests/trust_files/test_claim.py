"""One output, one run: claims of processes that live, die, fork and give up."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from excite_cli import claim as module
from excite_cli.atomic import write_atomically
from excite_cli.claim import claim, claimed
from excite_cli.errors import FileError


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


class Other:
    """Another process that does `action` and then waits to be killed."""

    def __init__(self, action: Callable[[], None]) -> None:
        ready, tell = os.pipe()
        self.number = os.fork()
        if not self.number:
            try:
                action()
                os.write(tell, b"x")
                signal.pause()
            finally:
                os._exit(1)
        os.close(tell)
        assert os.read(ready, 1), "the other process failed"
        os.close(ready)

    def kill(self) -> None:
        os.kill(self.number, signal.SIGKILL)
        os.waitpid(self.number, 0)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PATIENCE", 0.0)


def test_a_second_run_is_refused_and_told_who_has_it_until_the_first_is_killed(
    tmp_path: Path,
) -> None:
    path = tmp_path / "out.h5"
    other = Other(lambda: claim(path))
    with pytest.raises(FileError, match=rf"another run \(process {other.number} on "):
        claim(path)
    with pytest.raises(FileError, match="another run"):
        write_atomically(path, lambda file: file.write_text("mine"))
    with claimed(tmp_path / "other.h5"):  # the claim is on one file, not on the folder
        pass
    other.kill()
    assert names(tmp_path) == {".out.h5.lock"}
    with claimed(path):  # the same run may write what it has claimed
        write_atomically(path, lambda file: file.write_text("mine"))
        assert names(tmp_path) == {".out.h5.lock", "out.h5"}
    assert names(tmp_path) == {"out.h5"}
    path.unlink()
    write_atomically(path, lambda file: file.write_text("mine"))
    assert names(tmp_path) == {"out.h5"}


def test_a_worker_that_outlives_its_run_does_not_keep_the_claim(tmp_path: Path) -> None:
    path, workers = tmp_path / "out.h5", tmp_path / "worker"

    def run() -> None:
        claim(path)
        ready, running = os.pipe()
        worker = os.fork()
        if not worker:
            os.write(running, b".")
            signal.pause()
        os.read(ready, 1)  # it has let go of what it was born with
        workers.write_text(str(worker))

    other = Other(run)
    with pytest.raises(FileError, match="another run"):
        claim(path)
    other.kill()
    try:
        with claimed(path):
            pass
    finally:
        os.kill(int(workers.read_text()), signal.SIGKILL)


def test_what_a_killed_run_left_is_removed_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "out.h5"

    def die(file: Path) -> None:
        file.write_text("half")
        os.kill(os.getpid(), signal.SIGKILL)

    process = os.fork()
    if not process:
        write_atomically(path, die)
    os.waitpid(process, 0)
    left = names(tmp_path)
    assert len(left) == 2
    assert any(name.startswith(".out.h5.") and name.endswith(".part") for name in left)
    others = {".out.h5.old.abcdefgh.part", ".out.h5.bak", "out.h5.part", ".out.h5.ABCDEFGH.part"}
    for name in others:
        (tmp_path / name).write_text("somebody's")
    write_atomically(path, lambda file: file.write_text("whole"))
    assert names(tmp_path) == {*others, "out.h5"}


def test_folders_made_for_a_run_that_wrote_nothing_go_with_it(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    with claimed(tmp_path / "here" / "a" / "b" / "out.h5"):
        assert (tmp_path / "here" / "a" / "b").is_dir()
    assert list(tmp_path.iterdir()) == [tmp_path / "here"]
    assert list((tmp_path / "here").iterdir()) == []


def test_without_locks_of_the_file_system_files_are_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(handle: int, how: int) -> None:
        raise OSError(module.errno.ENOLCK, "No locks available")

    monkeypatch.setattr(module.fcntl, "flock", refuse)
    others = tmp_path / ".out.h5.abcdefgh.part"  # nobody can tell whether that run is alive
    others.write_text("half")
    write_atomically(tmp_path / "out.h5", lambda file: file.write_text("1"))
    assert names(tmp_path) == {"out.h5", others.name}


def test_a_lock_file_that_never_is_what_its_name_says_is_no_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[None] = []

    def never(one: os.stat_result, other: os.stat_result) -> bool:
        tried.append(None)
        assert len(tried) < 10_000, "it is tried for ever"
        return False

    monkeypatch.setattr(os.path, "samestat", never)
    (tmp_path / ".out.h5.abcdefgh.part").write_text("half")
    with claimed(tmp_path / "out.h5"):
        pass
    assert names(tmp_path) == {".out.h5.abcdefgh.part"}
