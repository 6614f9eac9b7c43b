"""Many independent tasks, done somewhere: what all kinds of workers have in common.

A task is an argument of a function that can be imported by name, `function(shared, task, tell)`.
`shared` is the same for all tasks and reaches every worker once. What a function returns may
depend on its arguments only: then it does not matter where, when and in which order tasks are
done, nor whether one is done twice because a worker was lost.
"""

import io
import pickle
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from excite_cli.errors import ExciteError
from excite_cli.out_of_core import Spool, attached, reference_to

# Messages between processes of one machine, in which large arrays are named and not copied.
#
# An array that lies in a file of this process (`out_of_core`) travels as the place in that file,
# and the other process maps it. What lies in memory and is large is written to such a file first.

# Bytes of an array that is written to a file, and of one that lies in one already.
_LARGE, _WORTH_NAMING = 2**18, 2**12
POSSIBLE = Path("/proc/self/fd").is_dir()


def packed(message: Any, spool: Spool | None = None) -> bytes:
    """A pickle of `message`; with a `spool`, which is to live until it is read, of little size."""
    if not POSSIBLE:
        return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    buffer = io.BytesIO()
    _Packer(buffer, spool).dump(message)
    return buffer.getvalue()


class _Packer(pickle.Pickler):
    def __init__(self, buffer: io.BytesIO, spool: Spool | None) -> None:
        super().__init__(buffer, pickle.HIGHEST_PROTOCOL)
        self._spool = spool

    def reducer_override(self, value: Any) -> Any:
        if type(value) is not np.ndarray or value.nbytes < _WORTH_NAMING or value.dtype.hasobject:
            return NotImplemented
        if not any(value.strides):  # one value, repeated
            return np.broadcast_to, (value.flat[0], value.shape)
        if self._spool is not None and value.nbytes >= _LARGE:
            value = self._spool.keep(value)
        reference = reference_to(value)
        return NotImplemented if reference is None else (attached, (reference,))


# Exceptions that travel from a worker to the caller.


def able_to_travel(error: Exception) -> Exception:
    """The error itself with its traceback as a note, or the nearest that can be pickled.

    An exception whose constructor wants more than its message does not come back from a pickle;
    then its first base class that does is taken, with the same message.
    """
    if not isinstance(error, ExciteError):
        error.add_note("In a worker:\n" + "".join(traceback.format_exception(error)))
    for kind in (None, *type(error).__mro__):
        try:
            candidate = error if kind is None else _as(error, kind)
            back = pickle.loads(pickle.dumps(candidate))
        except Exception:  # whatever a foreign exception does when it is pickled
            continue
        if isinstance(back, Exception) and str(back) == str(error):
            return candidate
    return RuntimeError(f"{type(error).__name__}: {error}")


def _as(error: Exception, kind: type) -> Exception:
    other = kind(str(error))
    if not isinstance(other, Exception):
        raise TypeError(kind)
    for note in getattr(error, "__notes__", ()):
        other.add_note(note)
    return other


Tell = Callable[[Any], None]
Function = Callable[[Any, Any, Tell], Any]

# How often a task may take its worker with it before it is given up.
LOSSES = 3


class LostWorkersError(ExciteError):
    """Workers end again and again, or cannot be started."""


@dataclass(frozen=True)
class News:
    """What happened last: task `index` told `word` while it runs, or ended with `result`.

    With `keep_failures` the result may be an exception.

    `done` of `total` tasks are done, `running` are being done.
    """

    done: int
    running: int
    total: int
    index: int
    word: Any = None
    result: Any = None


Watch = Callable[[News], None]


def unwatched(news: News) -> None:
    """Report to nobody."""


class Workers(ABC):
    """A place where tasks are done; to be closed, best with `with`."""

    @property
    @abstractmethod
    def count(self) -> int:
        """How many tasks are done at once."""

    @abstractmethod
    def map(
        self,
        function: Function,
        shared: Any,
        tasks: Iterable[Any],
        watch: Watch = unwatched,
        *,
        keep_failures: bool = False,
    ) -> list[Any]:
        """`function(shared, task, tell)` of every task, in their order.

        `watch` is called in the caller's thread whenever a task ends or tells a word. If tasks
        raise, the exception of the first one (in their order) is raised, and the rest is not done;
        with `keep_failures` an exception stands in the place of a result, and the rest is done.

        Raises
        ------
        LostWorkersError
            A task takes its worker with it each time, or workers cannot be started.
        """

    @property
    def reads_our_files(self) -> bool:
        """Whether what lies on the disk of this process is named to the workers and not copied."""
        return False

    def begin(self) -> None:  # noqa: B027 - most need not
        """Make ready for the first tasks, where that takes a while; not needed."""

    @abstractmethod
    def close(self) -> None:
        """End the workers; what they are doing is dropped."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
