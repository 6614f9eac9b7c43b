"""The workers that were requested, for whatever part of a command has tasks to share.

What is computed does not depend on them, so they are no argument of the functions in between.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from excite_cli.errors import ConfigError
from excite_cli.out_of_core import forget, room_of_spools
from excite_cli.shown.note import unheard
from excite_cli.workers.base import Function, Here, Workers

_place: ContextVar[Workers | None] = ContextVar("workers at hand", default=None)


@contextmanager
def at_hand(place: Workers | None) -> Iterator[None]:
    """Share tasks among the workers of `place` within the block; None: do them here."""
    if place is not None:
        place.begin()
    before = _place.set(place)
    try:
        # What lies on disk can be named to another process; what is in memory is written each time.
        with room_of_spools(0 if place is not None and place.reads_our_files else None):
            yield
    finally:
        _place.reset(before)


def each(function: Function, shared: Any, tasks: Iterable[Any]) -> Iterator[Any]:
    """`function(shared, task, tell)` of every task, in their order.

    A task is taken when there is somebody to do it; here, when its result is asked for. What lies
    on disk is forgotten in between.
    """
    place = _place.get()
    if place is None or place.count == 1:
        for task in tasks:
            yield function(shared, task, _silent)
            forget()
        return
    for result in place.map(function, shared, tasks):
        yield result
        forget()


def _silent(word: Any) -> None:
    """Words of single tasks are not told."""


MOST_WORKERS = 256


def open_workers(
    count: int = 1,
    scheduler: str | None = None,
    threads: int = 1,
    warn: Callable[[str], None] = unheard,
) -> Workers:
    """This process, `count` processes of this machine, or the dask cluster of `scheduler`.

    `threads` of linear algebra for each. To be closed, best with `with`.

    Raises
    ------
    ConfigError
        Both are requested, or less than one, or more than `MOST_WORKERS`.
    ClusterError, MissingExtraError
        See `Cluster`.
    """
    if not 1 <= count <= MOST_WORKERS:
        raise ConfigError(
            f"workers: {count} cannot be started. Allowed are 1 to {MOST_WORKERS}; on more "
            "processors, take a cluster (--scheduler)."
        )
    if scheduler is not None:
        from excite_cli.workers.cluster import Cluster

        if count != 1:
            raise ConfigError(
                "--scheduler has workers of its own, --workers are processes of this machine: "
                "give one of them."
            )
        return Cluster(scheduler, threads, warn)
    if count == 1:
        return Here()
    from excite_cli.workers.processes import Processes

    return Processes(count, threads)
