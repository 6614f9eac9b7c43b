"""An arm that follows set points as a position controller does: late, and with torques to measure.

Each joint is a critically damped second-order lag behind piecewise linear set points, solved
exactly. Torques are those of Pinocchio's rigid bodies, Coulomb and viscous friction, and noise.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.linalg import expm

BANDWIDTH = 60.0  # rad/s, a lag of 2 / 60 s
VISCOUS, COULOMB = 3.0, 4.0  # N·m s/rad, N·m, of every joint (N s/m, N of a sliding one)
NOISE = 0.05  # N·m, standard deviation


class TrackingArm:
    """State q, v, a (n) after each `step` of `period` seconds."""

    def __init__(self, urdf: Path, joints: Sequence[str], period: float) -> None:
        whole = pin.buildModelFromUrdf(str(urdf))
        locked = [i for i in range(1, whole.njoints) if whole.names[i] not in joints]
        self.model = pin.buildReducedModel(whole, locked, pin.neutral(whole))
        self.data = self.model.createData()
        assert list(self.model.names)[1:] == list(joints)
        self.joints = tuple(joints)
        w = BANDWIDTH
        # State, set point and its slope.
        flow = np.array([[0, 1, 0, 0], [-w * w, -2 * w, w * w, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
        self.exact = expm(flow * period)
        self.period, self.random = period, np.random.default_rng(3)
        self.place(np.zeros(self.model.nv))

    def place(self, q: np.ndarray) -> None:
        """Stand at `q`."""
        self.q, self.target = np.array(q, float), np.array(q, float)
        self.v, self.a = np.zeros_like(self.q), np.zeros_like(self.q)

    def step(self, target: np.ndarray) -> None:
        """One period later, the set point having gone to `target`."""
        slope = (target - self.target) / self.period
        self.q, self.v, *_ = self.exact @ np.stack([self.q, self.v, self.target, slope])
        self.target = np.array(target, float)
        self.a = BANDWIDTH**2 * (self.target - self.q) - 2 * BANDWIDTH * self.v

    def torque(self) -> np.ndarray:
        """At the joints, measured [N·m] (n)."""
        q = pin.integrate(
            self.model, pin.neutral(self.model), self.q
        )  # continuous joints: cos, sin
        tau = pin.rnea(self.model, self.data, q, self.v, self.a)
        tau = tau + VISCOUS * self.v + COULOMB * np.tanh(self.v / 1e-3)
        return tau + NOISE * self.random.standard_normal(len(tau))
