"""What a residual may depend on: a quantity, of which joint, and how it enters."""

import re
from dataclasses import dataclass
from enum import StrEnum
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


class Aspect(StrEnum):
    """How a quantity enters: by its value, by where it came from, with the direction of motion."""

    VALUE = ""
    HISTORY = "history of "
    DIRECTION = "direction and "


@dataclass(frozen=True)
class Covariate:
    """`quantity` of `joint`; `own` stands for that of whichever joint is looked at.

    Time, and which run it is, belong to no joint; of a further column of the log, `joint` is its
    name.
    """

    quantity: Source
    joint: str = ""
    aspect: Aspect = Aspect.VALUE
    own: bool = False

    @property
    def like(self) -> Source:
        """The quantity of which an effect would be a function: hysteresis is one of motion."""
        if self.quantity == "position" and self.aspect is not Aspect.VALUE:
            return "speed"
        return self.quantity

    @property
    def common(self) -> "Covariate":
        """The same for every joint: direction, history and load are each joint's own."""
        if self.quantity == "covariate" or (
            self.aspect is Aspect.VALUE and self.quantity != "load"
        ):
            return self
        return Covariate(self.quantity, "", self.aspect, own=True)

    @property
    def code(self) -> str:
        """As files and JSON have it: `time`, `q[elbow]`, `history of load[elbow]`, `own load`."""
        joint = f"[{self.joint}]" if self.joint else ""
        return f"{'own ' if self.own else ''}{self.aspect}{_SYMBOLS[self.quantity]}{joint}"

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
        own, aspect, symbol, joint = found.groups()
        return cls(_OF_SYMBOLS[symbol], joint or "", Aspect(aspect or ""), bool(own))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> core_schema.CoreSchema:
        """Records in files hold its code."""
        return core_schema.no_info_plain_validator_function(cls.of_code)


_CODE = re.compile(
    rf"(own )?({'|'.join(filter(None, Aspect))})?({'|'.join(_OF_SYMBOLS)})(?:\[(.+)\])?"
)
