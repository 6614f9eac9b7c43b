"""One result file, ready to be reported: its motions, and the problem they were made for."""

from dataclasses import dataclass

from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result


@dataclass(frozen=True)
class RebuiltResult:
    """A result with its rebuilt problem.

    `name` is that of the file. `number` counts the campaigns of a page from one; `alone` tells
    whether there are no others, so that titles need not say which one they belong to.
    """

    name: str
    result: Result
    problem: Problem
    number: int = 1
    alone: bool = True

    def anchor(self, topic: str) -> str:
        """The address of a section within the page; no two campaigns share one."""
        return topic if self.alone else f"{topic}-{self.number}"

    def titled(self, topic: str) -> str:
        """The title of a section, with the file's name where there are several files."""
        return topic if self.alone else f"{topic}: {self.name}"

    @property
    def motions(self) -> str:
        """`1 motion`, `3 motions`."""
        return counted(len(self.result.motions), "motion")


def counted(count: int, what: str) -> str:
    """`1 motion`, `3 motions`."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def in_figures(value: float, digits: int = 3) -> str:
    """A number as people write it: `0.00123`, `5.19`, `12400`, `1.2e+07`; `∞` and `–` beside."""
    if value != value:  # NaN
        return "–"
    if value == 0:
        return "0"
    if value in (float("inf"), float("-inf")):
        return "∞" if value > 0 else "-∞"
    if not 1e-4 <= abs(value) < 10 ** (digits + 3):
        return f"{value:.{digits - 1}e}"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:#.{digits}g}".rstrip(".")
