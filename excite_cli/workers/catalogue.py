"""Where work can be done, by what is asked for."""

from collections.abc import Callable

from excite_cli.errors import ConfigError
from excite_cli.workers.base import Workers
from excite_cli.workers.here import Here


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
        Both are asked for, or less than one.
    ClusterError, MissingExtraError
        See `Cluster`.
    """
    if count < 1:
        raise ConfigError(f"workers: {count} cannot do anything. Take 1 or more.")
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
