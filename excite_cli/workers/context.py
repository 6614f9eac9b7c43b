"""The workers that a command was given, for whatever part of it has tasks to share.

What is computed does not depend on them, so they are no argument of the functions in between.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from excite_cli.out_of_core import forget, room_of_spools
from excite_cli.workers.base import Function, Workers

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
