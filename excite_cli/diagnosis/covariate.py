"""What a residual may depend on: a quantity, of which joint, by its value or its history."""

import re
from dataclasses import dataclass
from typing import Any, Literal, Self

from pydantic_core import core_schema

from excite_cli.effects.base import Quantity

Source = Quantity | Literal["run"]

_SYMBOLS: dict[Source, str] = {
    "time": "time",
    "run": "run",
    "position": "q",
    "speed": "v",
    "acceleration": "a",
    "load": "load",
    "covariate": "column",
}
_OF_SYMBOLS = {symbol: quantity for quantity, symbol in _SYMBOLS.items()}


_HISTORY = "history of "


@dataclass(frozen=True)
class Covariate:
    """`quantity` of `joint`, or its `history`; `own` stands for whichever joint is looked at.

    Time, and which run it is, belong to no joint; of a further column of the log, `joint` is its
    name.
    """

    quantity: Source
    joint: str = ""
    history: bool = False
    own: bool = False

    @property
    def like(self) -> Source:
        """The quantity of which an effect would be a function: hysteresis is one of motion."""
        return "speed" if self.quantity == "position" and self.history else self.quantity

    @property
    def common(self) -> "Covariate":
        """The same for every joint: history and load are each joint's own."""
        if not (self.history or self.quantity == "load"):
            return self
        return Covariate(self.quantity, "", self.history, own=True)

    @property
    def code(self) -> str:
        """As files and JSON have it: `time`, `q[elbow]`, `history of load[elbow]`, `own load`."""
        joint = f"[{self.joint}]" if self.joint else ""
        how = "own " * self.own + _HISTORY * self.history
        return f"{how}{_SYMBOLS[self.quantity]}{joint}"

    @classmethod
    def of_code(cls, code: str) -> Self:
        """The covariate that `code` stands for.

        Raises
        ------
        ValueError
            It stands for none.
        """
        found = _CODE.fullmatch(code)
        if found is None:
            raise ValueError(f"'{code}' is nothing that a residual may depend on")
        own, history, symbol, joint = found.groups()
        return cls(_OF_SYMBOLS[symbol], joint or "", bool(history), bool(own))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> core_schema.CoreSchema:
        """Records in files hold its code."""
        return core_schema.no_info_plain_validator_function(cls.of_code)


_CODE = re.compile(rf"(own )?({_HISTORY})?({'|'.join(_OF_SYMBOLS)})(?:\[(.+)\])?")
