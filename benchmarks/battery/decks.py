"""The decks that cases come from: every kind, what a search gets wrong, friction with memory."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from benchmarks.battery import cases, hard_cases
from benchmarks.battery.cases import Case, Group


@dataclass(frozen=True)
class Deck:
    """Group and kind of a case by (seed, index), and the case itself."""

    label: Callable[[int, int], tuple[Group, str]]
    make_case: Callable[[int, int], Case]


DECKS: Mapping[str, Deck] = {
    "catalogue": Deck(cases.label, cases.make_case),
    "hard": Deck(hard_cases.label, hard_cases.make_case),
    "history": Deck(
        cases.label_of_history, partial(cases.make_case, labelled=cases.label_of_history)
    ),
}
