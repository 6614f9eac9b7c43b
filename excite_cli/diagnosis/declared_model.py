"""What a diagnosis knows before: robot, declared effects, a prior or none, what was weighed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.identification.declared_states import States
from excite_cli.identification.prior import InertialPrior, inertial_prior
from excite_cli.robot.model import Array, Robot


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
    prior: InertialPrior | None
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
        return self.weighed is not None and bool(self.weighed.any())

    @property
    def scales(self) -> Array:
        """`weighed`, or no rows."""
        width = self.base.rank + self.declared_width + 1
        return np.zeros((0, width)) if self.weighed is None else self.weighed

    @property
    def known(self) -> Array:
        """Rows as `weighed` of all that is known without data: the scales' and the prior's."""
        if self.prior is None:
            return self.scales
        return np.concatenate([self.scales, self.prior.rows(self.base, self.declared_width)])

    @property
    def by_urdf(self) -> Array:
        """φ_B (r,) of the URDF."""
        return np.asarray(self.base.mapping @ standard_parameters(self.robot))

    def full_inertias(self, parameters: Array) -> Array:
        """Full φ (P,) nearest to the URDF's that agrees with the fitted inertial parameters."""
        nearest = inertial_prior(self.robot, standard_parameters(self.robot), 1.0)
        return nearest.completed(self.base, parameters[: self.base.rank])


def width_of(effects: Sequence[Effect]) -> int:
    """Number of linear parameters of effects."""
    return sum(len(effect.parameters) for effect in effects)


def places_of(effects: Sequence[Effect], count: int) -> list[slice]:
    """Where the linear parameters of each effect are: together they are the last of `count`."""
    widths = [len(effect.parameters) for effect in effects]
    edges = (count - sum(widths) + np.cumsum([0, *widths])).tolist()
    return [slice(start, end) for start, end in pairwise(edges)]
