"""What a diagnosis knows before: robot, declared effects, a prior or none, what was weighed."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.identification.declared_states import States
from excite_cli.identification.prior import inertial_prior
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class KeptInertias:
    """Inertias kept at the URDF's: mean φ₀ (P,) and precision (P,) of the standard parameters."""

    mean: Array
    precision: Array


@dataclass(frozen=True)
class Model:
    """What is known before: robot, declared effects, a prior on the inertias, states of runs.

    `vague`: the prior is no word of the user's, who left the inertias to the data.
    `weighed` (m, r + k + 1): rows [W target] in standard deviations, over the base parameters and
    the parameters of the declared effects.
    """

    robot: Robot
    base: BaseParameters
    declared: tuple[Effect, ...]
    prior: KeptInertias | None
    states: States = field(default_factory=dict)
    weighed: Array | None = None
    vague: bool = False

    @property
    def declared_width(self) -> int:
        """Number of linear parameters of the declared effects."""
        return width_of(self.declared)

    @property
    def is_weighed(self) -> bool:
        """Whether scales say something of the parameters."""
        return bool(self.weighed_columns.any())

    @property
    def weighed_columns(self) -> Array:
        """As `weighed`, over the columns that are fitted: beside a prior, what differs from it."""
        rank, width = self.base.rank, self.declared_width
        rows = np.zeros((0, rank + width + 1)) if self.weighed is None else self.weighed
        if self.prior is None:
            return rows
        of_phi = rows[:, :rank] @ self.base.mapping
        rest = rows[:, -1:] - of_phi @ self.prior.mean[:, None]
        return np.hstack([of_phi, rows[:, rank:-1], rest])

    def full_inertias(self, parameters: Array) -> Array:
        """Full φ (P,) nearest to the URDF's that agrees with the fitted inertial parameters."""
        cad = standard_parameters(self.robot)
        if self.prior is not None:
            return np.asarray(self.prior.mean + parameters[: len(cad)])
        nearest = inertial_prior(self.robot, cad, 1.0)
        return nearest.completed(self.base, parameters[: self.base.rank])


def width_of(effects: Sequence[Effect]) -> int:
    """Number of linear parameters of effects."""
    return sum(len(effect.parameters) for effect in effects)
