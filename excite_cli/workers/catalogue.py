"""Where work can be done: the workers that were requested."""

from collections.abc import Callable

from excite_cli.errors import ConfigError
from excite_cli.workers.base import Here, Workers

MOST_WORKERS = 256


def open_workers(
    count: int = 1,
    scheduler: str | None = None,
    threads: int = 1,
    warn: Callable[[str], None] = lambda text: None,
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
