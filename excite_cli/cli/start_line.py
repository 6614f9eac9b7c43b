"""The progress line of motions that are being optimised, their starts one or many."""

from collections import defaultdict
from collections.abc import Callable
from typing import TYPE_CHECKING

from excite_cli.api.planning import most_motions
from excite_cli.api.showing import ProgressMeasure, figure_in_words
from excite_cli.cli.waiting import Line
from excite_cli.config.spec import Spec

if TYPE_CHECKING:
    from excite_cli.api.planning import Planned, Progress

# The figure of a progress line: where the solver is, and its best within all limits so far.


class Best:
    """Follows one motion; the best is the lowest condition number at a point that keeps limits."""

    def __init__(self) -> None:
        self._best = float("inf")

    def words(self, progress: "Progress") -> str:
        """`condition number 5.48 (best 5.31)`; another figure is reported as it is."""
        figure = progress.figure
        if figure.measure is not ProgressMeasure.CONDITION_NUMBER:
            return figure_in_words(figure)
        if progress.worst_margin >= 0.0:
            self._best = min(self._best, figure.value)
        best = f" (best {self._best:.2f})" if self._best < float("inf") else ""
        return f"condition number {figure.value:.2f}{best}"


def iterations_of(problem: "Planned") -> int:
    """The most that all starts of one motion take."""
    return problem.spec.optimizer.max_iterations * problem.restarts


def start_line(show: Line, spec: Spec, counted: bool = True) -> Callable[[int, "Progress"], None]:
    """What `plan` reports to, shown with `show(text, iterations done)`.

    counted: how many motions there will be is what the config says.
    """
    most = spec.optimizer.max_iterations
    of = " of" if spec.sequence.until is None else " of at most"
    of = f"{of} {most_motions(spec.sequence)}" if counted else ""
    best: dict[int, Best] = defaultdict(Best)

    def tell(index: int, progress: "Progress") -> None:
        words = f"motion {index}{of}: {best[index].words(progress)}, "
        starts = progress.starts
        if starts is None:
            show(f"{words}iteration {progress.iteration} of {most}", progress.iteration)
        else:
            words += f"{starts.done} of {starts.total} starts done, {starts.running} running"
            show(words, starts.iterations)

    return tell
