"""A family of mistakes that people make of one thing: which set-ups may be meant instead."""

from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from excite_cli.checks.base import Check, Log
from excite_cli.checks.check_result import CheckResult
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.checks.trust import key_of
from excite_cli.config.spec import Spec

Settings = dict[str, Any]  # by the path of the key in the config


@dataclass(frozen=True)
class Alternative:
    """Another set-up; the `joints` whose set-up it changes, none where it is that of all.

    `is_plain`: a round value, which is meant where it explains as much as any near it. Of what has
    the same joints and `variant` one is told. `price`, in L, of what hardly anybody does.
    """

    setup: Setup
    joints: tuple[int, ...] = ()
    variant: str = ""
    price: float = 0.0
    is_plain: bool = False


CLEAR = 0.5  # of L: what any other set-up must gain


def descended(
    fit: TextbookFit, setup: Setup, steps: Iterable[float], moved: Callable[[Setup, float], Setup]
) -> tuple[Setup, float]:
    """The set-up with the least L, one step after the other to either side, and L."""
    loss = fit(setup).loss
    for step in steps:
        for tried in (moved(setup, -step), moved(setup, step)):
            if (now := fit(tried).loss) < loss:
                loss, setup = now, tried
    return setup, loss


class SetupCheck(Check):
    """One thing that may be set up wrongly: sought together with all others of its kind."""

    kind: ClassVar[str]  # of its findings
    of_all: ClassVar[bool] = False  # whether what it is about shows on every joint
    is_physical: ClassVar[bool] = False  # whether it is no mistake, and so never a fault
    effect: ClassVar[str] = ""  # kind of effect that says the same, of which a diagnosis decides

    def look(self, log: Log) -> Iterable[CheckResult]:
        """Nothing: `set_up_search` asks for its alternatives."""
        return ()

    @abstractmethod
    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """What may be meant instead of a set-up."""

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """The alternative that explains most near the one that was found, and a plain one."""
        yield found

    @abstractmethod
    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """What is wrong."""

    @abstractmethod
    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """What to write in the config; nothing where no key says it."""

    def has_effect(self, before: Setup, after: Setup) -> bool:
        """Whether an effect of the model says the same as this mistake."""
        return self.is_physical or bool(self.effect)

    def trusted(self, names: Sequence[str], spec: Spec, joints: Sequence[int]) -> Settings:
        """What to write where the data are right as they are."""
        return key_of(self.name)

    def is_declared(self, name: str, spec: Spec) -> bool:
        """Whether the config says already how joint `name` is set up."""
        return False
