"""A campaign of many starts with one worker and with two, and what that says of more.

One motion is sought from 32 starts by one process, by two, by two of which one is killed on the
way, and by a dask cluster of two; all results are compared to the last bit. Then

    t(N) = start-up + serial + overhead · starts + longest queue(N)

with serial the time outside the starts, and the queue that of N workers who take the measured
starts in order, each as soon as it is free. The same with work / N for the queue is a lower bound.

Run: python -m benchmarks.scaling [--quick] [--no-dask] [--config talos_arms] [--starts 32]
"""

import argparse
import heapq
import os
import pickle
import resource
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import problem
from excite_cli.excitation.one_start import FoundMotion, StartContext
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.shown.note import unheard
from excite_cli.workers.base import Function, Here, News, Watch, Workers
from excite_cli.workers.processes import Processes

GOAL = 1.8
BEYOND = (8, 32, 128)
_NOTHINGS = 300
_DASK_READY = 3.0  # s


class Timed:
    """Other workers, with the seconds spent in `map` and those of every start."""

    def __init__(self, inner: Workers) -> None:
        self.inner, self.inside = inner, 0.0
        self.count = inner.count
        self.starts: list[float] = []

    def map(
        self, function: Function, shared: Any, tasks: Sequence[Any], watch: Watch = unheard
    ) -> list[Any]:
        def seen(news: News) -> None:
            if isinstance(news.result, FoundMotion):
                self.starts.append(news.result.seconds)
            watch(news)

        began = time.perf_counter()
        found = self.inner.map(function, shared, tasks, seen)
        self.inside += time.perf_counter() - began
        return found


@dataclass(frozen=True)
class Measured:
    """A campaign: seconds in all, outside the starts, of every start; processor time of workers."""

    result: Result
    seconds: float
    serial: float
    starts: tuple[float, ...]
    processor: float


def campaign(of: Problem, open_: Callable[[], Workers]) -> Measured:
    """From opening the workers to the finished motion."""

    def processor() -> float:
        spent = resource.getrusage(resource.RUSAGE_CHILDREN)
        return spent.ru_utime + spent.ru_stime

    before, began = processor(), time.perf_counter()
    with open_() as place:
        workers = Timed(place)
        result = continue_run(
            of,
            new_result(of, [], {}),
            lambda index: lambda progress: None,
            lambda step, current: None,
            workers=workers,
        )
        seconds = time.perf_counter() - began
    serial = seconds - workers.inside
    return Measured(result, seconds, serial, tuple(workers.starts), processor() - before)


def identical(first: Result, second: Result) -> bool:
    """Whether all that is stored of the motions is the same to the last bit, except seconds."""
    pairs = zip(first.motions, second.motions, strict=True)
    other = {"coefficients": 0, "seconds": 0}
    return np.array_equal(first.stack.factor, second.stack.factor) and all(
        np.array_equal(a.coefficients, b.coefficients) and vars(a) | other == vars(b) | other
        for a, b in pairs
    )


def nothing(shared: Any, task: Any, tell: Any) -> Any:
    return task


def start_up(of: Problem) -> tuple[float, float, int]:
    """Seconds until a worker has done a first task, of one task more, bytes that it was sent."""
    from benchmarks.scaling import nothing  # workers import it by this name, not from __main__

    shared = StartContext(of, InteriorPoint())
    stack = np.zeros((of.columns, of.columns))
    began = time.perf_counter()
    with Processes(1) as workers:
        workers.map(nothing, shared, [stack])
        ready = time.perf_counter() - began
        began = time.perf_counter()
        workers.map(nothing, shared, [stack] * _NOTHINGS)
        each = (time.perf_counter() - began) / _NOTHINGS
    return ready, each, len(pickle.dumps(shared, pickle.HIGHEST_PROTOCOL))


def queue(starts: Sequence[float], workers: int) -> float:
    """Seconds until `workers` have done all starts, each taking the next as soon as it is free."""
    free = [0.0] * workers
    for seconds in starts:
        heapq.heappush(free, heapq.heappop(free) + seconds)
    return max(free)


def killed_later(seconds: float, pid: Callable[[], int]) -> None:
    """Kill a process after a while."""
    timer = threading.Timer(seconds, lambda: os.kill(pid(), signal.SIGKILL))
    timer.daemon = True
    timer.start()


def two_of_which_one_is_killed(after: float) -> Workers:
    workers = Processes(2)
    killed_later(after, lambda: workers.pids[0])
    return workers


@contextmanager
def dask(kill_after: float | None = None):
    """Opens workers of a cluster of two, one of which is killed after a while."""
    from distributed import LocalCluster

    from excite_cli.workers.cluster import Cluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        if kill_after is not None:
            killed_later(kill_after, lambda: next(iter(cluster.workers.values())).pid)
        yield lambda: Cluster(cluster.scheduler_address, warn=print)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="talos_arms")
    parser.add_argument("--starts", type=int, default=32)
    parser.add_argument("--iterations", type=int, default=120)
    parser.add_argument("--repeats", type=int, default=2, help="of one and two workers, in turn")
    parser.add_argument("--quick", action="store_true", help="8 short starts, once")
    parser.add_argument("--no-dask", action="store_true")
    asked = parser.parse_args()
    if asked.quick:
        asked.starts, asked.iterations, asked.repeats = 8, 15, 1
    of = problem(
        asked.config,
        f"optimizer.restarts={asked.starts}",
        f"optimizer.max_iterations={asked.iterations}",
        *("optimizer.max_seconds=3600", "sequence.motions=1"),
    )
    print(
        f"{asked.config}, {of.variables} variables; one motion, {asked.starts} starts of at most "
        f"{asked.iterations} iterations; {len(os.sched_getaffinity(0))} processors, load "
        f"{os.getloadavg()[0]:.1f} before"
    )
    ready, each, sent = start_up(of)
    print(
        f"a worker is ready after {ready:.2f} s (the problem is {sent / 1e6:.2f} MB for it), a "
        f"task costs {1e3 * each:.2f} ms more than its work"
    )
    one, two = _one_and_two(of, asked.repeats)
    motion = one.result.motions[0]
    print(
        f"one worker {one.seconds:.1f} s, two {two.seconds:.1f} s: "
        f"{one.seconds / two.seconds:.2f} times as fast (goal {GOAL}); processor time of the "
        f"workers {one.processor:.1f} and {two.processor:.1f} s\n"
        f"best of {asked.starts} starts: condition number {motion.condition_number:.4f}; starts "
        f"take {min(one.starts):.2f} to {max(one.starts):.2f} s, {np.mean(one.starts):.2f} s on "
        f"average; {one.serial:.2f} s outside them"
    )
    _identical("two workers", one, two)
    if asked.quick:
        _identical("in this process", one, campaign(of, Here))
    quarter = 0.25 * two.seconds
    opened = partial(two_of_which_one_is_killed, ready + quarter)
    _identical("two workers, one killed", one, campaign(of, opened))
    if not asked.no_dask:
        for words, after in (("dask", None), ("dask, one killed", _DASK_READY + quarter)):
            with dask(after) as opened:
                _identical(words, one, campaign(of, opened))
    _predict(one, two, ready, each)


def _one_and_two(of: Problem, repeats: int) -> list[Measured]:
    """The median of each, in turn."""
    found: dict[int, list[Measured]] = {1: [], 2: []}
    for number in range(repeats):
        for count in (1, 2) if number % 2 == 0 else (2, 1):
            found[count].append(campaign(of, partial(Processes, count)))
            print(f"  workers {count}: {found[count][-1].seconds:.1f} s", flush=True)
    middle = (repeats - 1) // 2
    return [sorted(every, key=lambda each: each.seconds)[middle] for every in found.values()]


def _identical(words: str, one: Measured, other: Measured) -> None:
    same = "identical to the last bit" if identical(one.result, other.result) else "DIFFERENT"
    print(f"{words} ({other.seconds:.1f} s): {same}", flush=True)


def _predict(one: Measured, two: Measured, ready: float, each: float) -> None:
    """What more workers would take, each on a processor of its own like these."""
    starts, serial = list(one.starts), one.serial
    many = list(np.random.default_rng(1).choice(starts, 1024))

    def predicted(durations: Sequence[float], workers: int) -> float:
        return ready + serial + each * len(durations) + queue(durations, workers)

    check = predicted(starts, 2)
    print(f"t(2) predicted from one worker: {check:.1f} s, measured {two.seconds:.1f} s")
    print(f"{'workers':>8} {len(starts):>5} starts  times   work/N   1024 starts  times")
    for workers in (1, 2, *BEYOND):
        now, much = predicted(starts, workers), predicted(many, workers)
        least = ready + serial + sum(starts) / workers
        print(
            f"{workers:8} {now:10.1f} s {predicted(starts, 1) / now:6.1f} {least:7.1f} s "
            f"{much:10.1f} s {predicted(many, 1) / much:6.1f}"
        )
    print(
        f"(start-up {ready:.2f} s, serial {serial:.2f} s, {1e3 * each:.2f} ms a task; the one "
        f"process that hands out tasks is busy from {np.mean(starts) / each:.0f} workers on)"
    )


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
