"""What benchmarks write into pages: tables of Markdown, percentages, parts between two marks."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from excite_cli.atomic import write_text_atomically


@dataclass(frozen=True)
class MarkedPart:
    """The part called `name`, written by the module `by`."""

    name: str
    by: str

    @property
    def begin(self) -> str:
        """The mark before it."""
        return f"<!-- {self.name}: written by {self.by} -->"

    @property
    def end(self) -> str:
        """The mark after it."""
        return f"<!-- {self.name}: end -->"

    def replaced(self, page: str, content: str) -> str:
        """`page` with `content` between the two marks.

        Raises
        ------
        ValueError
            The page lacks the marks.
        """
        before, _, rest = page.partition(self.begin)
        _, found, after = rest.partition(self.end)
        if not found:
            raise ValueError(f"the page lacks {self.begin} … {self.end}")
        return f"{before}{self.begin}\n{content}\n{self.end}{after}"

    def write(self, path: Path, content: str) -> None:
        """Put `content` between the two marks of a page."""
        page = self.replaced(path.read_text(encoding="utf-8"), content)
        write_text_atomically(path, page)


def table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Markdown; columns whose head ends with a colon are right-aligned."""
    bars = ["---:" if head.endswith(":") else "---" for head in heads]
    lines = [[head.removesuffix(":") for head in heads], bars, *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def percent(value: float) -> str:
    """`12 %`, `8.8 %`, `–` where there is none."""
    if not isfinite(value):
        return "–"
    return f"{100 * value:.0f} %" if value >= 0.0995 else f"{100 * value:.1f} %"
