"""An offset of the torque that follows a column of the log: τ_j = k (c − c₀).

Torque sensors drift with their temperature, and with what flows beside them. An offset beside it is
the one at the reference c₀.
"""

from collections.abc import Sequence
from typing import ClassVar

from excite_cli.effects.base import Abscissa, Cotangents, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.of_covariate import PER_UNIT, OfCovariate
from excite_cli.robot.model import Array


class CovariateOffset(OfCovariate):
    """τ_j = offset_slope · (c − c₀), of either sign."""

    kind: ClassVar = "covariate_offset"
    title: ClassVar = "offset that follows a column of the log"
    signature: ClassVar = "the residual rises and falls with the column, however the joint moves"
    function_of: ClassVar = ("covariate",)
    parameters: ClassVar = (Parameter("offset_slope", f"N·m{PER_UNIT}", 1e-4, 0.2),)
    data_defect: ClassVar = True
    changes_of: ClassVar = ("torque_offset",)

    def columns(self, signals: Signals) -> Array:
        """δ, (T, 1, 1)."""
        return self.deviation_of(signals)[:, None, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """b δ."""
        delta = self.deviation_in_c(columns)
        return f"tau[{self.joints[0]}] += {real(values[0])} * {delta};"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """Nothing: it does not depend on the motion."""
        return Cotangents()

    def abscissa(self, signals: Signals) -> Abscissa:
        """The column."""
        return Abscissa(f"column {self.covariate}", "unit", signals.covariates[self.covariate])
