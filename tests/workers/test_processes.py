"""Tasks in processes: order, errors, deaths, what reaches a worker, what is left behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.workers.base import LostWorkersError, News, Workers
from excite_cli.workers.catalogue import open_workers
from excite_cli.workers.here import Here
from excite_cli.workers.processes import Processes
from tests.workers import work


@pytest.fixture(scope="module")
def two() -> Iterator[Processes]:
    with Processes(2) as workers:
        yield workers


@pytest.fixture(params=["here", "processes"])
def workers(request: pytest.FixtureRequest, two: Processes) -> Workers:
    return Here() if request.param == "here" else two


def alive(pid: int) -> bool:
    """Whether the process runs; one that ended and was not waited for does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def gone(pid: int, within: float = 5.0) -> bool:
    end = time.monotonic() + within
    while alive(pid) and time.monotonic() < end:
        time.sleep(0.02)
    return not alive(pid)


def test_results_come_in_the_order_of_the_tasks(workers: Workers) -> None:
    assert workers.map(work.later_first, 0.2, [0, 1, 2, 3]) == [0, 1, 2, 3]
    assert workers.map(work.square, 10, [3, 4]) == [19, 26]
    assert workers.map(work.square, 10, []) == []


def test_tasks_are_taken_when_somebody_is_there_to_do_them(two: Processes) -> None:
    heard: list[News] = []
    ahead: list[int] = []

    def tasks() -> Iterator[int]:
        for task in range(6):
            ahead.append(task - sum(news.result is not None for news in heard))
            yield task

    assert two.map(work.square, 0, tasks(), heard.append) == [0, 1, 4, 9, 16, 25]
    assert max(ahead) <= 2
    assert two.map(work.square, 0, iter(())) == []


def test_what_the_source_of_tasks_raises_is_raised(two: Processes) -> None:
    def tasks() -> Iterator[int]:
        yield 1
        raise ConfigError("no second task")

    with pytest.raises(ConfigError, match="no second task"):
        two.map(work.square, 0, tasks())
    assert two.map(work.square, 0, [2, 3]) == [4, 9]


def test_everything_is_told(workers: Workers) -> None:
    heard: list[News] = []
    workers.map(work.square, 0, [5, 6, 7], heard.append)
    ends = [news for news in heard if news.result is not None]
    assert sorted((news.index, news.result) for news in ends) == [(0, 25), (1, 36), (2, 49)]
    assert [news.done for news in ends] == [1, 2, 3]
    assert all(news.total == 3 and 0 <= news.running <= workers.count for news in heard)
    assert ("at 5", 0) in {(news.word, news.index) for news in heard}


def test_the_first_failure_is_raised_whoever_was_ready_first(workers: Workers) -> None:
    with pytest.raises(ConfigError, match="task 1 is wrong"):
        workers.map(work.fails, 1, [0, 1, 2, 3])
    first, second, third = workers.map(work.fails, 1, [0, 1, 2], keep_failures=True)
    assert first == 0
    assert isinstance(second, ConfigError)
    assert str(third) == "a later one, sooner"


def test_after_a_failure_nobody_waits_for_later_tasks(two: Processes) -> None:
    began = time.monotonic()
    with pytest.raises(ConfigError, match="the first is wrong"):
        two.map(work.fails_beside_a_long_one, 0, [0, 1, 2])
    assert time.monotonic() - began < 30.0
    assert two.map(work.square, 0, [2, 3, 4]) == [4, 9, 16]


def test_a_worker_has_its_threads_and_no_part_of_the_current_folder(
    two: Processes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("json", "sys", "pickle"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('code of the current folder')")
    monkeypatch.syspath_prepend(str(tmp_path / "modules"))
    monkeypatch.chdir(tmp_path)
    with Processes(1, threads=2) as one:
        assert one.map(work.search_path, 0, [1]) == [sys.path]
        assert set(one.map(work.threads, 0, [1])[0]) == {min(2, os.cpu_count() or 2)}
    assert set(two.map(work.threads, 0, [1])[0]) == {1}


def test_errors_travel_as_the_nearest_that_can(two: Processes) -> None:
    with pytest.raises(NoAdmissibleMotionError, match="no way"):
        two.map(work.long_winded, 0, [1])
    with pytest.raises(KeyError) as caught:
        two.map(work.bug, 0, [1])
    assert "work.py" in "".join(caught.value.__notes__), "the place of a bug is lost"


def test_a_worker_that_dies_costs_its_task_a_second_try(two: Processes, tmp_path: Path) -> None:
    assert two.map(work.dies_once, str(tmp_path), [2, 3, 4, 5]) == [4, 9, 16, 25]
    assert len(two.pids) == 2


def test_a_task_that_kills_every_worker_is_given_up(two: Processes) -> None:
    with pytest.raises(LostWorkersError, match=r"Task 1 of 1 was given up: 3 times .*signal 9"):
        two.map(work.always_dies, 0, [1])
    assert two.map(work.square, 0, [2]) == [4]


def test_one_killed_from_outside_changes_nothing(two: Processes, tmp_path: Path) -> None:
    """One that has said that it began; another one does its task, a new or the surviving one."""
    killed: list[int] = []

    def kill() -> None:
        while not (begun := list(tmp_path.glob("*.begun"))):
            time.sleep(0.01)
        killed.append(int(begun[0].stem))
        os.kill(killed[0], signal.SIGKILL)
        (tmp_path / "go").touch()

    killer = threading.Thread(target=kill)
    killer.start()
    seen = two.map(work.begun, str(tmp_path), [1, 2, 3])
    killer.join()
    assert len(seen) == 3
    assert killed[0] not in {*seen, *two.pids}
    assert len(two.pids) == 2


def test_an_interrupt_leaves_nothing_behind() -> None:
    heard: list[int] = []

    def interrupted(news: News) -> None:
        heard.extend(workers.pids)
        raise KeyboardInterrupt

    with Processes(2) as workers, pytest.raises(KeyboardInterrupt):
        workers.map(work.later_first, 5.0, [0, 20, 0], interrupted)
    assert heard
    assert all(gone(pid) for pid in heard)


def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    script = """
from excite_cli.workers.processes import Processes
from tests.workers import work
workers = Processes(2)
workers.map(work.square, 0, [1, 2])
print(*workers.pids, flush=True)
workers.map(work.later_first, 60.0, [0, 0])
"""
    root = Path(__file__).parents[2]
    parent = subprocess.Popen(
        [sys.executable, "-c", script], cwd=root, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert len(pids) == 2
    assert all(alive(pid) for pid in pids)
    time.sleep(0.3)  # they are at work now
    parent.kill()
    parent.communicate()
    assert all(gone(pid) for pid in pids)


def test_what_is_asked_for_decides_where() -> None:
    assert isinstance(open_workers(), Here)
    with open_workers(2) as workers:
        assert isinstance(workers, Processes)
        assert (workers.count, workers.pids) == (2, ()), "they begin before there is a task"
        workers.begin()
        assert len(workers.pids) == 2
        # They have what the parent has imported.
        assert workers.map(work.imported, "excite_cli.workers.processes", [0]) == [True]
    with pytest.raises(ConfigError, match="give one of them"):
        open_workers(2, "tcp://localhost:8786")
    with pytest.raises(ConfigError, match="Allowed are 1 to"):
        open_workers(0)
