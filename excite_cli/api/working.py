"""Workers, and what is worth saying about them."""

import os
from contextlib import AbstractContextManager

from excite_cli.shown.note import Level, Note, Tell, saying
from excite_cli.workers.base import Workers
from excite_cli.workers.context import open_workers

# How many threads the linear algebra library takes.


def single_threaded(threads: int = 1) -> AbstractContextManager[object]:
    """Limit the linear algebra library: its matrices here are too small for many threads."""
    # Only libraries that are loaded by then are limited: those of SciPy and of Pinocchio.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    import excite_cli.robot.model  # noqa: F401

    return threadpool_limits(limits=threads)


def working(workers: int, scheduler: str | None, threads: int, tell: Tell) -> Workers:
    """Workers as requested, to be closed.

    Raises
    ------
    ConfigError, ClusterError, MissingExtraError
        See `open_workers`.
    """
    place = open_workers(workers, scheduler, threads, saying(tell))
    there = _processors()
    if scheduler is not None:
        tell(Note(Level.INFO, f"{scheduler}: {place.count} tasks at once"))
    elif workers > there:
        text = (
            f"{workers} workers share {there} processors, so {there} would be as fast; "
            "with more of them, starts may end at optimizer.max_seconds"
        )
        tell(Note(Level.WARNING, text))
    return place


def tell_idle(workers: int, starts: int, tell: Tell) -> None:
    """A hint where a motion has fewer starts than there are workers."""
    if workers > starts:
        busy = "one start keeps one" if starts == 1 else f"{starts} starts keep {starts}"
        text = f"{busy} of {workers} workers busy; see --starts"
        tell(Note(Level.HINT, text))


def _processors() -> int:
    """Those that this process may use; where the system does not tell, all."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
