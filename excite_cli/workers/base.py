"""Many independent tasks, done somewhere: what all kinds of workers have in common.

A task is an argument of a function that can be imported by name, `function(shared, task, tell)`.
`shared` is the same for all tasks and reaches every worker once. What a function returns may
depend on its arguments only: then it does not matter where, when and in which order tasks are
done, nor whether one is done twice because a worker was lost.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from excite_cli.errors import ExciteError

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
