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
    there = len(os.sched_getaffinity(0))
    if scheduler is not None:
        terminal.say(f"{scheduler}: {place.count} tasks at once")
    elif workers > there:
        terminal.say(
            f"warning: {workers} workers share {there} processors, so {there} would be as fast; "
            "with more of them, starts may end at optimizer.max_seconds"
        )
    return place
