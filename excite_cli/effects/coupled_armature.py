"""Rotor of a gear that is coupled with its neighbour's, as in the wrists of many arms.

The rotor of a shaft that turns with v_j + s v_k, s = ±1, has the energy ½ I (v_j + s v_k)²:

    τ_j = s I a_k,    τ_k = s I a_j

beside I a_j and I a_k, which are left to the joints' own rotors. The friction of that shaft is
`coupled_friction`. About parallel axes it is, beside other inertias of the links, the second
joint's own rotor with the other sign: a leg of a Go2 was given that in its place.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Cotangents, Effect, Parameter, Scope, Signals
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array, Robot

_PARALLEL = 0.999  # cosine of 2.5°


class CoupledArmature(Effect):
    """τ_j = c a_k and τ_k = c a_j with c = s I."""

    kind: ClassVar = "coupled_armature"
    title: ClassVar = "inertia of the motor of coupled gears"
    signature: ClassVar = "a joint's residual follows its neighbour's acceleration, and the reverse"
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (Parameter("inertia", "kg·m²", 0.01, 3.0),)

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """Joints and those that they carry, unless both turn, or slide, along parallel axes."""
        return [pair for pair in super().places(robot) if not _parallel(robot, *pair)]

    def columns(self, signals: Signals) -> Array:
        """a_k and a_j, (T, 2, 1)."""
        return signals.a[:, list(self.joints)[::-1], None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """c a_k, c a_j."""
        (j, k), c = self.joints, real(values[0])
        return f"tau[{j}] += {c} * a[{k}];\ntau[{k}] += {c} * a[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂a of either joint is the other row's weight."""
        back = np.zeros_like(signals.a)
        back[:, list(self.joints)] = weights[:, ::-1, 0]
        return Cotangents(a=back)


def _parallel(robot: Robot, j: int, k: int) -> bool:
    """Whether two joints, of which the first carries the second, have parallel axes."""
    rest = np.zeros((1, robot.n))
    body = RigidBody(robot, standard_parameters(robot), rest, rest, rest)
    slides = robot.sliding[[j, k]]
    linear, angular = np.split(body.frame_jacobian(k)[0][:, [j, k]], 2)
    one, other = np.where(slides, linear, angular).T
    return bool(slides[0] == slides[1] and abs(one @ other) > _PARALLEL)
