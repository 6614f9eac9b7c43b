"""Workers of a dask cluster: the only file that knows dask.

dask does the tasks of a lost worker again by itself. What all tasks share is itself the result of
a task, so that it too is made again where it was lost.
"""

import asyncio
import hashlib
import logging
import pickle
import platform
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

import excite_cli
from excite_cli.errors import optional_module
from excite_cli.workers.base import (
    Answer,
    Function,
    Give,
    LostWorkersError,
    NoWorkersError,
    Tell,
    Workers,
)
from excite_cli.workers.worker_main import keep_memory, outcome

# What must be the same on every machine that takes part, and what better is.
#
# The same task gives the same numbers only with the same program and libraries. The last digits
# also depend on the instructions that the linear algebra library picks for a processor: that is
# seen by trying, and told.

_LIBRARIES = ("numpy", "scipy", "pin", "coal", "clarabel")


@cache
def environment() -> dict[str, str]:
    """Versions of the libraries, the digest of our own source, which inner loops are in use."""
    versions = {"Python": platform.python_version(), "excite": _own_source()}
    for name in _LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = "none"
    # By its name, since that package is above this one.
    loops = import_module("excite_cli.kernels.compiled").KERNELS
    return {**versions, "kernels": "numpy" if loops is None else "compiled"}


def _own_source() -> str:
    """Version and the first letters of a digest of all our Python files."""
    folder, digest = Path(excite_cli.__file__).parent, hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(path.read_bytes())
    return f"{excite_cli.__version__} ({digest.hexdigest()[:8]})"


def rounding() -> str:
    """Digest of a small computation of each kind that the program does."""
    import numpy as np
    from scipy.linalg import cho_factor, cho_solve, qr
    from threadpoolctl import threadpool_limits

    a = np.random.default_rng(1).normal(size=(200, 60))
    digest = hashlib.sha256()
    with threadpool_limits(limits=1):
        gram = a.T @ a
        parts = [
            gram,
            qr(a, mode="r")[0],
            np.linalg.eigvalsh(gram),
            np.linalg.svd(a, compute_uv=False),
            cho_solve(cho_factor(gram), a[0]),
            np.sin(a) + np.exp(a) + np.log(np.abs(a)) + np.sqrt(np.abs(a)),
            np.array([a.sum()]),
        ]
    for part in parts:
        digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:12]


_ANSWER, _FIRST_WORKER = 5.0, 10.0  # [s] to wait for the scheduler, and for a worker
_FAMILIAR = ("tcp://", "tls://", "ws://", "wss://", "inproc://", "ucx://")
_TALKATIVE = ("", ".client", ".core", ".comm", ".utils")


class ClusterError(NoWorkersError):
    """No cluster at the address, or one that cannot do our tasks."""


class Cluster(Workers):
    """The workers of the dask scheduler at `address`, `threads` of linear algebra for each task.

    `warn` is called with what should be known: workers that round in another way.

    Raises
    ------
    MissingExtraError
        dask is not installed.
    ClusterError
        There is no scheduler or no worker, or one has other versions of our libraries.
    """

    def __init__(
        self, address: str, threads: int = 1, warn: Callable[[str], None] = lambda text: None
    ) -> None:
        library = optional_module(
            "distributed",
            "--scheduler needs dask. Install it with: pip install 'excite-cli[cluster]'",
        )
        self.address, self._threads = address, threads
        for name in _TALKATIVE:  # what matters of it we say ourselves
            logging.getLogger(f"distributed{name}").setLevel(logging.CRITICAL)
        try:
            asyncio.run(asyncio.wait_for(_greet(address), _ANSWER))
            self._client = library.Client(address, timeout=_ANSWER, set_as_default=False)
        except Exception as error:  # what else listens there may answer anything
            raise ClusterError(_no_scheduler(address, error)) from error
        try:
            self._meet(warn)
        except BaseException:
            self.close()
            raise

    @property
    def count(self) -> int:
        """Tasks that the workers of now do at once."""
        return max(1, sum(self._client.nthreads().values()))

    @property
    def ahead(self) -> int:
        """Twice as many as are done at once: the next one is there when one ends."""
        return 2 * self.count

    def close(self) -> None:
        """Leave the cluster; it goes on running."""
        self._client.close()

    @contextmanager
    def _round(self, function: Function, shared: Any) -> Iterator[Give]:
        blob = pickle.dumps(shared, pickle.HIGHEST_PROTOCOL)
        futures = [self._submitted(bytes, blob)]
        common = (hashlib.sha256(blob).hexdigest(), futures[0])

        def give(task: Any, tell: Tell) -> Any:  # words of tasks are not heard from afar
            job = pickle.dumps((function, task), pickle.HIGHEST_PROTOCOL)
            futures.append(self._submitted(_do, *common, job, self._threads, environment()))
            return futures[-1]

        try:
            yield give
        finally:
            self._client.cancel(futures, force=True)

    def _submitted(self, function: Callable[..., Any], *arguments: Any) -> Any:
        with warnings.catch_warnings():  # recordings are large, and travel once
            warnings.filterwarnings("ignore", "Sending large graph")
            return self._client.submit(function, *arguments, pure=False)

    def answer(self, future: Any) -> Answer:
        """As `Workers.answer`; `ClusterError` if no more can be done."""
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise LostWorkersError(
                "each time its worker was lost while doing it "
                f"({error.last_worker.address}). Often memory is short there."
            ) from error
        except CancelledError as error:
            raise self._refusal(
                "the scheduler is gone. Start it again; with --resume what is done already is kept."
            ) from error
        except ImportError as error:
            raise self._refusal(
                f"a worker cannot do the task ({error}). Install the same excite there."
            ) from error

    def _meet(self, warn: Callable[[str], None]) -> None:
        """See that there are workers, and that they compute as this process does."""
        try:
            self._client.wait_for_workers(1, timeout=_FIRST_WORKER)
            there = self._client.run(_there)
        except TimeoutError as error:
            raise self._refusal(
                f"it has no workers. Start some: dask worker {self.address} --nthreads 1"
            ) from error
        except ImportError as error:
            raise self._refusal(
                f"its workers do not have excite ({error}). Install it where they run."
            ) from error
        for worker, (versions, _) in there.items():
            _check_versions(worker, environment(), versions)
        here = rounding()
        others = [worker for worker, (_, digest) in there.items() if digest != here]
        if others:
            more = f" and {len(others) - 1} more" if len(others) > 1 else ""
            warn(
                f"warning: {others[0]}{more} rounds in another way than this machine (another "
                "kind of processor): results agree to rounding only. OPENBLAS_CORETYPE=Haswell and "
                "NPY_DISABLE_CPU_FEATURES for all of them can make them the same."
            )

    def _refusal(self, text: str) -> ClusterError:
        return ClusterError(f"--scheduler {self.address}: {text}")


async def _greet(address: str) -> None:
    """Ask a scheduler who it is; a client that finds none leaves threads and complaints behind."""
    from distributed.core import rpc

    async with rpc(address) as scheduler:
        await scheduler.identity()


def _there() -> tuple[dict[str, str], str]:
    return environment(), rounding()


def _do(key: str, shared: bytes, job: bytes, threads: int, versions: dict[str, str]) -> Answer:
    """One task, in a worker of the cluster."""
    from distributed import get_worker
    from threadpoolctl import threadpool_limits

    keep_memory()
    try:  # workers may have come later
        _check_versions(f"worker {get_worker().address}", versions, environment())
    except ClusterError as error:
        return "failed", error
    with threadpool_limits(limits=threads):
        return outcome(key, shared, job, lambda word: None)


def _check_versions(worker: str, here: dict[str, str], there: dict[str, str]) -> None:
    differs = ", ".join(
        f"{name} {version} here, {there.get(name, 'none')} there"
        for name, version in here.items()
        if version != there.get(name)
    )
    if differs:
        raise ClusterError(
            f"--scheduler: {worker} has other versions, so its results would differ ({differs}). "
            "Install the same on all machines."
        )


def _no_scheduler(address: str, error: Exception) -> str:
    reason = f" ({error})" if isinstance(error, ValueError) else ""
    form = "" if address.startswith(_FAMILIAR) else " An address looks like tcp://host:8786."
    return (
        f"--scheduler {address}: no dask scheduler answers there{reason}.{form} Start one with "
        "`dask scheduler`, and on every machine `dask worker ADDRESS --nthreads 1`."
    )
