"""What effects have in common that follow a further column of the log, such as a temperature.

With c the column and c₀ its reference, an effect is linear in a deviation δ from the reference,
c − c₀ or a curve that begins like it: what it changes keeps its meaning there. A diagnosis takes
the mean of c over the training data for c₀. Nobody says in which unit the column is: sizes are per
unit of it. Any curve is an approximation: what another would leave of it is no effect of its own.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Effect, Parameter, Signals, Value
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array, Robot

PER_UNIT = "/unit"
_SAME = 1e-9  # of its size: a column that changes by less stands still


class OfCovariate(Effect):
    """Proportional to δ, by default c − c₀."""

    shapes: ClassVar[tuple[Parameter, ...]] = (Parameter("reference", "unit", 1.0, 100.0),)
    defaults: ClassVar[Mapping[str, float]] = {"reference": 0.0}
    follows_covariate: ClassVar = True
    excitable: ClassVar = False
    why_not_excitable: ClassVar = "no motion changes a further column of the log"

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """The mean of the column over all signals; nothing where it never changes."""
        (column,) = (
            np.concatenate(each)
            for each in zip(*(seen.covariates.values() for seen in signals), strict=True)
        )
        if np.ptp(column) <= _SAME * np.abs(column).max():
            return []
        return [{"reference": float(column.mean())}]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """The reference is no choice."""
        return ()

    def deviation_of(self, signals: Signals) -> Array:
        """δ (T,)."""
        return signals.covariates[self.covariate] - self.shape["reference"]

    def deviation_in_c(self, columns: Sequence[str]) -> str:
        """c − c₀ in C."""
        place = list(columns).index(self.covariate)
        return f"(column[{place}] - {real(self.shape['reference'])})"

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Sizes per unit of the column, and where it is at its reference."""
        found = super().report(values, covariance)
        return {
            name: Value(each.value, each.std, self._unit(each.unit)) for name, each in found.items()
        }

    def _unit(self, unit: str) -> str:
        if unit.endswith(PER_UNIT):
            size = unit.removesuffix(PER_UNIT).removeprefix("1")
            return f"{size} per unit of {self.covariate}".strip()
        return f"units of {self.covariate}"
