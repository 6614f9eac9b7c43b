"""Tasks here and in processes: order, errors, deaths, what reaches a worker, what is left."""

import os
import select
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.workers.base import Here, LostWorkersError, News, NoWorkersError, Workers
from excite_cli.workers.context import open_workers
from excite_cli.workers.processes import Processes
from tests.workers import work

HANGS = 120.0  # s


@pytest.fixture(scope="module")
def two() -> Iterator[Processes]:
    with Processes(2) as workers:
        yield workers


@pytest.fixture(params=["here", "processes"])
def workers(request: pytest.FixtureRequest, two: Processes) -> Workers:
    return Here() if request.param == "here" else two


def test_results_come_in_the_order_of_the_tasks(two: Processes, tmp_path: Path) -> None:
    assert two.map(work.after_the_next, str(tmp_path), [0, 1, 2, 3]) == [0, 1, 2, 3]


def test_everything_is_heard(workers: Workers) -> None:
    heard: list[News] = []
    assert workers.map(work.square, 10, []) == []
    assert workers.map(work.square, 0, [5, 6, 7], heard.append) == [25, 36, 49]
    ends = [news for news in heard if news.result is not None]
    assert sorted((news.index, news.result) for news in ends) == [(0, 25), (1, 36), (2, 49)]
    assert [news.done for news in ends] == [1, 2, 3]
    assert all(news.total == 3 and 0 <= news.running <= workers.count for news in heard)
    assert ("at 5", 0) in {(news.word, news.index) for news in heard}


def test_tasks_are_taken_when_somebody_is_there_to_do_them(workers: Workers) -> None:
    heard: list[News] = []
    ahead: list[int] = []

    def tasks() -> Iterator[int]:
        for task in range(6):
            ahead.append(task - sum(news.result is not None for news in heard))
            yield task
        if workers.count == 1:
            raise ConfigError("no seventh task")

    if workers.count == 1:
        with pytest.raises(ConfigError, match="no seventh task"):
            workers.map(work.square, 0, tasks(), heard.append)
    else:
        assert workers.map(work.square, 0, tasks(), heard.append) == [0, 1, 4, 9, 16, 25]
    assert max(ahead) < workers.count
    assert workers.map(work.square, 0, iter(())) == []


@pytest.mark.long
def test_the_first_failure_is_raised_or_all_are_kept(workers: Workers) -> None:
    with pytest.raises(ConfigError, match="task 1 is wrong"):
        workers.map(work.fails, 1, [0, 1, 2, 3])
    first, second, third = workers.map(work.fails, 1, [0, 1, 2], keep_failures=True)
    assert first == 0
    assert isinstance(second, ConfigError)
    assert str(third) == "task 2 is wrong"


@pytest.mark.long
def test_after_a_failure_nobody_waits_for_later_tasks(two: Processes, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="the first is wrong"):
        two.map(work.after_the_next, str(tmp_path), [10, 11])
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


@pytest.mark.long
def test_errors_travel_as_the_nearest_that_can(two: Processes) -> None:
    with pytest.raises(NoAdmissibleMotionError, match="no way"):
        two.map(work.long_winded, 0, [1])
    with pytest.raises(KeyError) as caught:
        two.map(work.bug, 0, [1])
    assert "work.py" in "".join(caught.value.__notes__), "the place of a bug is lost"
    with pytest.raises(Exception, match="lambda"):
        two.map(work.unpicklable, 0, [1])


@pytest.mark.long
def test_a_worker_that_dies_costs_its_task_a_second_try(two: Processes, tmp_path: Path) -> None:
    assert two.map(work.dies_once, str(tmp_path), [2, 3, 4, 5]) == [4, 9, 16, 25]
    good, lost = two.map(work.always_dies_at, 1, [0, 1], keep_failures=True)
    assert good == 0
    with pytest.raises(LostWorkersError, match=r"Task 2 of 2 was given up: 3 times .*signal 9"):
        raise lost


def test_workers_that_cannot_be_started_end_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("excite_cli.workers.processes._BOOT", "raise SystemExit(3)")
    with Processes(2) as workers, pytest.raises(NoWorkersError, match=r"at once .exit status 3"):
        workers.map(work.square, 0, [1], keep_failures=True)


@pytest.mark.long
def test_an_interrupt_leaves_nothing_behind() -> None:
    ends: list[int] = []

    def interrupted(news: News) -> None:
        ends.extend(os.pidfd_open(pid) for pid in workers.pids)
        raise KeyboardInterrupt

    with Processes(2) as workers, pytest.raises(KeyboardInterrupt):
        workers.map(work.forever, None, [0, 1], interrupted)
    assert ends
    assert select.select(ends, [], [], 0)[0] == ends


def test_workers_end_when_their_parent_is_killed() -> None:
    script = """
from excite_cli.workers.processes import Processes
from tests.workers import work
workers = Processes(2)
workers.map(work.square, 0, [1, 2])
workers.begin()
workers.map(work.forever, 0, [0, 0], lambda news: print(*workers.pids, flush=True))
"""
    root = Path(__file__).parents[2]
    parent = subprocess.Popen(
        [sys.executable, "-c", script], cwd=root, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    ends = [os.pidfd_open(int(word)) for word in parent.stdout.readline().split()]
    assert len(ends) == 2
    parent.kill()
    parent.communicate()
    for end in ends:
        assert select.select([end], [], [], HANGS)[0], "it outlives its parent"
        os.close(end)


@pytest.mark.long
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
