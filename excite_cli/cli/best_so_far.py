"""The figure of a progress line: where the solver is, and its best within all limits so far."""

from typing import TYPE_CHECKING

from excite_cli.api.showing import Measure, figure_in_words

if TYPE_CHECKING:
    from excite_cli.api.planning import Progress


class Best:
    """Follows one motion; the best is the lowest condition number at a point that keeps limits."""

    def __init__(self) -> None:
        self._best = float("inf")

    def words(self, progress: "Progress") -> str:
        """`condition number 5.48 (best 5.31)`; another figure is reported as it is."""
        figure = progress.figure
        if figure.measure is not Measure.CONDITION_NUMBER:
            return figure_in_words(figure)
        if progress.worst_margin >= 0.0:
            self._best = min(self._best, figure.value)
        best = f" (best {self._best:.2f})" if self._best < float("inf") else ""
        return f"condition number {figure.value:.2f}{best}"
