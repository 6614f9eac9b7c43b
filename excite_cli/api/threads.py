"""How many threads the linear algebra library takes."""

from contextlib import AbstractContextManager


def single_threaded(threads: int = 1) -> AbstractContextManager[object]:
    """Limit the linear algebra library: its matrices here are too small for many threads."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=threads)
