"""Workers of a dask cluster: the only file that knows dask.

dask does the tasks of a lost worker again by itself. What all tasks share is itself the result of
a task, so that it too is made again where it was lost.
"""

import asyncio
import hashlib
import logging
import pickle
import platform
import struct
import threading
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError
from dataclasses import dataclass
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

import excite_cli
from excite_cli.errors import ExciteError, MissingExtraError
from excite_cli.workers.base import (
    Function,
    LostWorkersError,
    News,
    Watch,
    Workers,
    able_to_travel,
    unwatched,
)
from excite_cli.workers.worker_main import keep_memory

# What must be the same on every machine that takes part, and what better is.
#
# The same task gives the same numbers only with the same program and libraries. The last digits
# also depend on the instructions that the linear algebra library picks for a processor: that is
# seen by trying, and told.

_LIBRARIES = ("numpy", "scipy", "pin", "coal", "clarabel")


@dataclass(frozen=True)
class Environment:
    """Versions of the libraries, the digest of our own source, and how numbers are rounded.

    Among the versions is whether the inner loops are the compiled ones.
    """

    versions: tuple[tuple[str, str], ...]
    rounding: str

    def against(self, other: "Environment") -> str:
        """In words, what differs from `other` and must not; empty if nothing does."""
        mine, theirs = dict(self.versions), dict(other.versions)
        return ", ".join(
            f"{name} {mine[name]} here, {theirs.get(name, 'none')} there"
            for name in mine
            if mine[name] != theirs.get(name)
        )


@cache
def environment() -> Environment:
    """Those of this process."""
    versions = [("Python", platform.python_version()), ("excite", _own_source())]
    for name in _LIBRARIES:
        try:
            versions.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            versions.append((name, "none"))
    versions.append(("kernels", _kernels()))
    return Environment(tuple(versions), _rounding())


def _kernels() -> str:
    """Which inner loops are in use; by name, since their package is above this one."""
    found = import_module("excite_cli.kernels.compiled").KERNELS
    return "numpy" if found is None else "compiled"


def _own_source() -> str:
    """Version and the first letters of a digest of all our Python files."""
    folder, digest = Path(excite_cli.__file__).parent, hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(path.read_bytes())
    return f"{excite_cli.__version__} ({digest.hexdigest()[:8]})"


def _rounding() -> str:
    """Digest of a small computation of each kind that the program does."""
    import numpy as np
    from scipy.linalg import cho_factor, cho_solve, qr
    from threadpoolctl import threadpool_limits

    rng = np.random.default_rng(1)
    a = rng.normal(size=(200, 60))
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
        digest.update(struct.pack(f"{part.size}d", *np.ascontiguousarray(part).ravel()))
    return digest.hexdigest()[:12]


_ANSWER, _FIRST_WORKER = 5.0, 10.0  # [s] to wait for the scheduler, and for a worker
_FAMILIAR = ("tcp://", "tls://", "ws://", "wss://", "inproc://", "ucx://")
_TALKATIVE = ("", ".client", ".core", ".comm", ".utils")
# What a worker's thread has unpickled last: threads must not share a problem.
_held = threading.local()


class ClusterError(ExciteError):
    """No cluster at the address, or one that cannot do our tasks."""


@dataclass(frozen=True)
class _Failure:
    error: Exception


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
        try:
            from distributed import Client
        except ImportError as error:
            raise MissingExtraError(
                "--scheduler needs dask. Install it with: pip install 'excite-cli[cluster]'"
            ) from error
        self.address, self._threads = address, threads
        for name in _TALKATIVE:  # what matters of it we say ourselves
            logging.getLogger(f"distributed{name}").setLevel(logging.CRITICAL)
        try:
            asyncio.run(asyncio.wait_for(_greet(address), _ANSWER))
            self._client = Client(address, timeout=_ANSWER, set_as_default=False)
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

    def map(
        self,
        function: Function,
        shared: Any,
        tasks: Iterable[Any],
        watch: Watch = unwatched,
        *,
        keep_failures: bool = False,
    ) -> list[Any]:
        """As `Workers.map`; words of tasks are not told."""
        from distributed import as_completed

        tasks = list(tasks)
        if not tasks:
            return []
        blob = pickle.dumps(shared, pickle.HIGHEST_PROTOCOL)
        digest = hashlib.sha256(blob).hexdigest()
        with warnings.catch_warnings():  # recordings are large, and travel once
            warnings.filterwarnings("ignore", "Sending large graph")
            held = self._client.submit(_as_it_is, blob, pure=False)
            futures = [
                self._client.submit(
                    _do, digest, held, function, task, self._threads, environment(), pure=False
                )
                for task in tasks
            ]
        place = {future.key: index for index, future in enumerate(futures)}
        done = 0
        try:
            for future in as_completed(futures, loop=self._client.loop):
                index = place[future.key]
                result = self._result(future, index, len(tasks))
                if isinstance(result, _Failure):
                    if not keep_failures or isinstance(result.error, ClusterError):
                        break
                    result = result.error
                done += 1
                running = min(self.count, len(tasks) - done)
                watch(News(done, running, len(tasks), index, result=result))
            found: list[Any] = []
            for index, future in enumerate(futures):  # the first that failed, whoever was ready
                result = self._result(future, index, len(tasks))
                if isinstance(result, _Failure):
                    if not keep_failures or isinstance(result.error, ClusterError):
                        raise result.error
                    result = result.error
                found.append(result)
            return found
        finally:
            self._client.cancel([held, *futures], force=True)

    def close(self) -> None:
        """Leave the cluster; it goes on running."""
        self._client.close()

    def _meet(self, warn: Callable[[str], None]) -> None:
        try:
            self._client.wait_for_workers(1, timeout=_FIRST_WORKER)
        except TimeoutError as error:
            raise ClusterError(
                f"--scheduler {self.address}: it has no workers. Start some: dask worker "
                f"{self.address} --nthreads 1"
            ) from error
        try:
            there: dict[str, Environment] = self._client.run(_there)
        except ImportError as error:
            raise ClusterError(
                f"--scheduler {self.address}: its workers do not have excite ({error}). Install "
                "it where they run."
            ) from error
        here = environment()
        for worker, found in there.items():
            differs = here.against(found)
            if differs:
                raise ClusterError(_other_versions(worker, differs))
        others = [worker for worker, found in there.items() if found.rounding != here.rounding]
        if others:
            more = f" and {len(others) - 1} more" if len(others) > 1 else ""
            warn(
                f"warning: {others[0]}{more} rounds in another way than this machine (another "
                "kind of processor): results agree to rounding only. OPENBLAS_CORETYPE=Haswell and "
                "NPY_DISABLE_CPU_FEATURES for all of them can make them the same."
            )

    def _result(self, future: Any, index: int, total: int) -> Any:
        """The result, or what was raised instead."""
        from distributed import KilledWorker

        try:
            kind, value = future.result()
        except KilledWorker as error:
            return _Failure(
                LostWorkersError(
                    f"Task {index + 1} of {total} was given up: each time its worker was lost "
                    f"while doing it ({error.last_worker.address}). Often memory is short there."
                )
            )
        except CancelledError:
            return _Failure(
                ClusterError(
                    f"--scheduler {self.address}: the scheduler is gone. Start it again; with "
                    "--resume what is done already is kept."
                )
            )
        except ImportError as error:
            return _Failure(
                ClusterError(
                    f"--scheduler {self.address}: a worker cannot do the task ({error}). Install "
                    "the same excite there."
                )
            )
        return value if kind == "done" else _Failure(value)


async def _greet(address: str) -> None:
    """Ask a scheduler who it is; a client that finds none leaves threads and complaints behind."""
    from distributed.core import rpc

    async with rpc(address) as scheduler:
        await scheduler.identity()


def _there() -> Environment:
    return environment()


def _as_it_is(blob: bytes) -> bytes:
    return blob


def _do(
    digest: str, blob: bytes, function: Function, task: Any, threads: int, asked: Environment
) -> tuple[str, Any]:
    """One task, in a worker of the cluster."""
    from threadpoolctl import threadpool_limits

    keep_memory()
    try:
        differs = asked.against(environment())  # workers may have come later
        if differs:
            raise ClusterError(_other_versions(f"worker {_own_address()}", differs))
        if getattr(_held, "digest", "") != digest:
            _held.shared, _held.digest = pickle.loads(blob), digest
        with threadpool_limits(limits=threads):
            return "done", function(_held.shared, task, lambda word: None)
    except Exception as error:  # all of them are raised by the caller
        return "failed", able_to_travel(error)


def _own_address() -> str:
    from distributed import get_worker

    return str(get_worker().address)


def _other_versions(worker: str, differs: str) -> str:
    return (
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
