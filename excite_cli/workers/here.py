"""The default: tasks are done one after the other in this process."""

from collections.abc import Iterable
from typing import Any

from excite_cli.workers.base import Function, News, Watch, Workers, unwatched


class Here(Workers):
    """No other process; what a task raises ends the rest."""

    @property
    def count(self) -> int:
        """One."""
        return 1

    def map(
        self,
        function: Function,
        shared: Any,
        tasks: Iterable[Any],
        watch: Watch = unwatched,
        *,
        keep_failures: bool = False,
    ) -> list[Any]:
        """As `Workers.map`."""
        tasks, results = list(tasks), []
        total = len(tasks)
        for index, task in enumerate(tasks):

            def tell(word: Any, index: int = index) -> None:
                watch(News(index, 1, total, index, word=word))

            try:
                results.append(function(shared, task, tell))
            except Exception as error:
                if not keep_failures:
                    raise
                results.append(error)
            watch(News(index + 1, 0, total, index, result=results[-1]))
        return results

    def close(self) -> None:
        """Nothing to end."""
