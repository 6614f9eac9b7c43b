"""From --workers and --scheduler to workers; what is worth saying about them."""

import os

from excite_cli.cli.console import Terminal
from excite_cli.workers.base import Workers
from excite_cli.workers.catalogue import open_workers


def working(terminal: Terminal, workers: int, scheduler: str | None, threads: int = 1) -> Workers:
    """Workers as asked for, to be closed.

    Raises
    ------
    ConfigError, ClusterError, MissingExtraError
        See `open_workers`.
    """
    place = open_workers(workers, scheduler, threads, terminal.say)
    there = _processors()
    if scheduler is not None:
        terminal.say(f"{scheduler}: {place.count} tasks at once")
    elif workers > there:
        terminal.say(
            f"warning: {workers} workers share {there} processors, so {there} would be as fast; "
            "with more of them, starts may end at optimizer.max_seconds"
        )
    return place


def tell_idle(terminal: Terminal, workers: int, starts: int) -> None:
    """A hint where a motion has fewer starts than there are workers."""
    if workers > starts:
        busy = "one start: one worker has" if starts == 1 else f"{starts} starts: {starts} have"
        terminal.say(f"hint: {busy} something to do, of {workers} workers; see --starts")


def _processors() -> int:
    """Those that this process may use; where the system does not tell, all."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
