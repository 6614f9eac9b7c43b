"""States of runs that the configuration declares: who carries what, by labels.

    runs: {monday_3: {payload: tool_2kg}, tuesday_1: {payload: tool_2kg}, friday_2: {payload: none}}

Runs with one label share one state: an effect of that kind is in all of them or in none. Where
labels of a kind are declared, runs without one are without the effect.
"""

from collections.abc import Mapping

from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.errors import ConfigError, nearest

NONE = "none"

States = Mapping[str, Mapping[str, str]]  # run -> kind -> label


def check_states(states: States, names: tuple[str, ...]) -> None:
    """Refuse states of runs that are not among the `names` of the data, or of other kinds.

    Raises
    ------
    ConfigError
        There is no such run or kind, or the kind does not differ between runs.
    """
    for run, labels in states.items():
        if run not in names:
            raise ConfigError(
                f"runs: there is no run '{run}' in the data.{nearest(run, names)} "
                f"Runs: {', '.join(names)}."
            )
        for kind in labels:
            found = kind_named(kind, f"runs.{run}")
            if not differs_between_runs(found):
                able = [name for name, k in catalogue().items() if differs_between_runs(k)]
                raise ConfigError(
                    f"runs.{run}: {kind} is not of single runs. Kinds that are: {', '.join(able)}."
                )


def differs_between_runs(kind: type[Effect]) -> bool:
    """Whether runs may have states of `kind`."""
    return kind.per_run or kind.changes_between_runs


def declared_sets(kind: str, states: States) -> list[tuple[str, ...]] | None:
    """The sets of runs that share a state of `kind`; None if nothing is declared of it."""
    labels = {run: of_run[kind] for run, of_run in states.items() if kind in of_run}
    if not labels:
        return None
    there = dict.fromkeys(label for label in labels.values() if label != NONE)
    return [tuple(run for run, its in labels.items() if its == label) for label in there]
