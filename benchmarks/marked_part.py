"""The part of a page that a benchmark writes: it stands between two marks."""

from dataclasses import dataclass


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
