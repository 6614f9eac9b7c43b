"""The decks that cases come from; what is asked of a case depends on its deck."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal

from benchmarks.battery import as_they_are, campaigns, cases, hard_cases
from benchmarks.battery.cases import Case


@dataclass(frozen=True)
class Deck:
    """Group and kind of a case by (seed, index), and the case itself.

    `beside`: what the error is compared with, that of the fit that knows the truth, the one before,
    or the best of a textbook's fits. Where it is the one before, the data go through a file, and
    recordings, sizes and rests are judged as well.
    """

    label: Callable[[int, int], tuple[str, str]]
    make_case: Callable[[int, int], Case]
    beside: Literal["truth", "before", "textbook"] = "truth"
    first: int = 0


def _group(seed: int, index: int) -> tuple[str, str]:
    return campaigns.group_of(seed, index), ""


DECKS: Mapping[str, Deck] = {
    "catalogue": Deck(cases.label, cases.make_case),
    "hard": Deck(hard_cases.label, hard_cases.make_case),
    "history": Deck(
        cases.label_of_history, partial(cases.make_case, labelled=cases.label_of_history)
    ),
    "campaigns": Deck(_group, campaigns.make_case, "before"),
    "columns": Deck(_group, campaigns.make_case, "before", campaigns.FIRST_WITH_COLUMNS),
    "as_they_are": Deck(lambda seed, index: ("", ""), as_they_are.make_case, "textbook"),
}
