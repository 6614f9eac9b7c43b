"""Friction curves that are not in the catalogue, integrated along a motion.

LuGre (Canudas de Wit et al. 1995): ż = v − σ₀ |v| z / g(v), F = σ₀ z + σ₁ ż, with
g(v) = F_c + (F_s − F_c) exp(−(v / v_s)²). GMS (Al-Bender et al. 2005), without its slow drift in
slip: four Maxwell elements of stiffness k and least force α g(v). Both plus a viscous curve
F_v |v|^p sign(v) of its own in each direction.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.robot.model import Array

_ELEMENTS = 4


@dataclass(frozen=True)
class Curve:
    """Friction of n joints, each (n,): N·m, rad, rad/s.

    `bristle`: how far [rad] a joint moves before it slips. `backward`: what all is multiplied by
    where the speed is negative. `rough` has no memory at all where it is 0.
    """

    coulomb: Array
    breakaway: Array
    stribeck: Array
    viscous: Array
    power: Array
    bristle: Array
    backward: Array
    by_load: Array
    memory: str

    def torque(self, t: Array, v: Array, load: Array, warmth: Array) -> Array:
        """Friction (T, n) along speeds v (T, n) at equal steps; `warmth` (T,) scales the viscous.

        `load` (T, n): torque that the gear carries.
        """
        height = self.coulomb + (self.breakaway - self.coulomb) * np.exp(
            -np.square(v / self.stribeck)
        )
        height = (height + self.by_load * np.abs(load)) * np.where(v < 0, self.backward, 1.0)
        slipping = self.viscous * np.abs(v) ** self.power * np.sign(v)
        slipping = slipping * warmth[:, None] * np.where(v < 0, self.backward, 1.0)
        if self.memory == "none":
            return np.asarray(slipping + height * np.tanh(v / (0.02 * self.stribeck + 1e-6)))
        step = float(t[1] - t[0])
        if self.memory == "lugre":
            return np.asarray(slipping + self._lugre(step, v, height))
        return np.asarray(slipping + self._maxwell(step, v, height))

    def _lugre(self, step: float, v: Array, height: Array) -> Array:
        stiffness = self.coulomb / self.bristle
        z, found = np.zeros(v.shape[1]), np.empty_like(v)
        damping = 0.02 * np.sqrt(stiffness)
        rate = stiffness * np.abs(v) / height
        decay = np.exp(-rate * step)
        slip = np.where(rate * step > 1e-9, -np.expm1(-rate * step) / (rate + 1e-300), step)
        for k in range(len(v)):
            new = decay[k] * z + slip[k] * v[k]
            found[k] = stiffness * new + damping * (new - z) / step
            z = new
        return found

    def _maxwell(self, step: float, v: Array, height: Array) -> Array:
        shares = np.arange(1, _ELEMENTS + 1)
        shares = shares / shares.sum()
        stiffness = self.coulomb / self.bristle / _ELEMENTS
        force, found = np.zeros((_ELEMENTS, v.shape[1])), np.empty_like(v)
        for k in range(len(v)):
            most = shares[:, None] * height[k]
            force = np.clip(force + stiffness * v[k] * step, -most, most)
            found[k] = force.sum(axis=0)
        return found
