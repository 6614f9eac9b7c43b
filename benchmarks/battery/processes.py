"""Cases judged by processes of their own, each with one thread for its matrices."""

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from benchmarks.battery.tables import Rate

T = TypeVar("T")


def outcomes_of(
    judged: Callable[[int, int], T], seed: int, indices: Sequence[int], workers: int
) -> Iterator[T]:
    """Outcomes as they come."""
    if workers < 2:
        for index in indices:
            yield _one(judged, seed, index)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as processes:
        for done in as_completed([processes.submit(_one, judged, seed, i) for i in indices]):
            yield done.result()


def _one(judged: Callable[[int, int], T], seed: int, index: int) -> T:
    with threadpool_limits(1):
        return judged(seed, index)


def write(path: Path, seed: int, rates: Sequence[Rate], outcomes: Sequence[Any]) -> None:
    """Everything as JSON, whole after each case."""
    content = {
        "seed": seed,
        "rates": {rate.name: [rate.count, rate.out_of] for rate in rates},
        "cases": [asdict(o) for o in sorted(outcomes, key=lambda o: o.index)],
    }
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(content, indent=1, ensure_ascii=False, default=float))
    partial.replace(path)
