"""What `sequence.until` asks of motions, beside what they have: figures of their data.

Information grows with the seconds of motions: those of a UR10 with 3 to 12 s each have the same
deviation² · seconds within 10 %. So what is lacking is a factor of information, and of seconds.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from excite_cli.config.spec import UntilSpec
from excite_cli.diagnosis.expectation import Expectation, expectation
from excite_cli.diagnosis.power import EffectPower, least_sizes, price, times_named
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ConfigError
from excite_cli.excitation.invariant import FreeDesign, Invariants, design_for, invariants
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem, predicting
from excite_cli.excitation.result import Result

# Beyond this condition number the information cannot be inverted: nothing is precise yet.
_SINGULAR = 1e7


@dataclass(frozen=True)
class Goal:
    """A figure that is asked for, in `words` with what it is, and how far from it the motions are.

    `needed`: information that it takes, as a multiple of that of the data; at most 1 where it is
    reached, infinite where longer motions are no help. `holds_out`: whether the last motion of
    several does not count.
    """

    words: str
    needed: float
    holds_out: bool = False

    def fitted(self, motions: int) -> int:
        """How many of so many motions count."""
        return motions - (self.holds_out and motions > 1)


class Goals:
    """What `sequence.until` of a problem asks for, and whether a result has it.

    `known`: a problem with a prediction, and earlier data on its columns.

    Raises
    ------
    ConfigError
        The precision of a robot is asked for where a load is excited; no planned motion shows an
        effect that is to be named, or none is named that is as small.
    """

    def __init__(self, problem: Problem, known: tuple[Problem, Stack] | None = None) -> None:
        self._problem, self._known = problem, known
        self._until = problem.spec.sequence.until or UntilSpec()
        if self._until.precise and problem.spec.criterion.of != "robot":
            raise ConfigError(
                "sequence.until: predicted_deviation, power, torque_deviation and efficiency are "
                "those of a robot's parameters, and criterion.of is "
                f"{problem.spec.criterion.of}. Leave them out."
            )
        for kind, size in self._until.power.items():
            self._refuse_too_small(kind, size)

    def reached(self, result: Result) -> bool:
        """Whether the data of `result` are as precise as asked; false where nothing is asked."""
        return self._until.precise and all(goal.needed <= 1.0 for goal in self.of(result))

    def of(self, result: Result) -> tuple[Goal, ...]:
        """Every figure that is asked for, as the data of `result` have it."""
        found: list[Goal] = []
        if self._until.counts_seconds:
            asked = self._until.power
            expected = expectation(self._problem, result, asked, self._known)
            found += [*self._of_deviation(expected), *self._of_power(expected)]
        if self._until.torque_deviation is not None or self._until.efficiency is not None:
            found += self._of_instants(result.stack)
        return tuple(found)

    def _refuse_too_small(self, kind: str, size: float) -> None:
        where = "sequence.until.power"
        kind_named(kind, where)
        start = self._known[0] if self._known else self._problem
        prediction = predicting(start, tuple(self._until.power)).prediction
        assert prediction is not None
        least = max(least_sizes(prediction, kind), key=lambda each: each.size)
        if size < (1.0 - 1e-9) * least.size:
            raise ConfigError(
                f"{where}.{kind}: {size:g} {least.unit} is too small to matter on "
                f"{', '.join(least.joints)}, and a diagnosis does not name it, whatever the "
                f"motions. Ask for {least.size:.3g} {least.unit} or more."
            )

    def _of_deviation(self, expected: Expectation) -> Iterator[Goal]:
        asked = self._until.predicted_deviation
        if asked is not None:
            found = expected.deviations[-1] if expected.deviations else np.inf
            yield Goal(_deviation_in_words(found, asked), (found / asked) ** 2)

    def _of_power(self, expected: Expectation) -> Iterator[Goal]:
        """Of every kind that of the joint that lacks most, of those on which motions show it."""
        until: UntilSpec = self._until
        probability = until.probability
        alpha = self._problem.spec.diagnosis.significance
        for kind in until.power:
            least = times_named(price(kind_named(kind), alpha), probability)
            of = [each for each in expected.power if each.kind == kind]
            shown = [each for each in of if each.times > 0.0]
            worst = min(shown or of, key=lambda each: each.times)
            hidden = [joint for each in of if each.times == 0.0 for joint in each.joints]
            words = _power_in_words(worst, probability, hidden if shown else [])
            needed = (least / worst.times) ** 2 if worst.times else np.inf
            yield Goal(words, float(needed), holds_out=True)

    def _of_instants(self, stack: Stack) -> Iterator[Goal]:
        most, least = self._until.torque_deviation, self._until.efficiency
        shown = stack.rows > 0 and (  # what no motion shows is bounded by a prediction's prior
            self._problem.prediction is not None or np.linalg.cond(stack.factor) < _SINGULAR
        )
        found = invariants(self._problem, stack, self._design) if shown else Invariants(np.inf, 0.0)
        if most is not None:
            deviation = found.torque_deviation
            yield Goal(_deviation_in_words(deviation, most), (deviation / most) ** 2)
        if least is not None:
            assert found.efficiency is not None
            words = (
                f"information efficiency {100 * found.efficiency:.2g} % relative to D-optimal free "
                f"states (asked: {100 * least:g} %)"
            )
            yield Goal(words, 0.0 if found.efficiency >= least else np.inf)

    @cached_property
    def _design(self) -> FreeDesign | None:
        return None if self._until.efficiency is None else design_for(self._problem)


def _deviation_in_words(found: float, asked: float) -> str:
    return f"predicted-torque standard deviation {found:.3g} σ of one sample (asked: {asked:g})"


def _power_in_words(worst: EffectPower, probability: float, hidden: list[str]) -> str:
    words = (
        f"{worst.kind} of {worst.size:g} {worst.unit} named with {worst.power:.0%} on "
        f"{', '.join(worst.joints)} (asked: {probability:.0%} on every joint)"
    )
    aside = f"; no motion shows it on {', '.join(hidden)}, which is left out"
    return words + aside * bool(hidden)
