"""What an effect sees of a motion, and how its derivative is handed back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.measurement.run_identity import RunId

if TYPE_CHECKING:
    from excite_cli.dynamics.rigid_body import RigidBody
    from excite_cli.robot.model import Array


@dataclass(frozen=True)
class Signals:
    """What an effect may look at: one run, or one planned motion, at equidistant instants.

    `t` (T,) from the start of the run [s]; `q, v, a` (T, n); `load` (T, n) rigid-body torque of
    the model so far, `torque` (T, n) all of it with the effects found; `body` gives the derivatives
    of the rigid-body torque. `start` is the campaign's time at t = 0 [s]. `covariates` (T,) by name
    are further columns of the log that effects may follow, in whatever unit they were recorded.
    `before` (L, n): positions of the same time step before the first, where they are known.
    `laden`: `body` with bodies among the effects found, if there are any.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    load: Array
    torque: Array
    body: RigidBody
    run: RunId = field(default_factory=RunId)
    start: float = 0.0
    covariates: Mapping[str, Array] = field(default_factory=dict)
    before: Array | None = None
    laden: RigidBody | None = None

    @property
    def whole_body(self) -> RigidBody:
        """The rigid body with all that it carries."""
        return self.body if self.laden is None else self.laden

    def forget(self) -> None:
        """Let go of what the rigid body can compute again."""
        for body in (self.body, self.whole_body):
            body.forget()

    @property
    def clock(self) -> Array:
        """Time on the campaign's clock (T,) [s]."""
        return self.start + self.t

    def every(self, step: int) -> Signals:
        """Every `step`-th instant."""
        before = None if self.before is None else self.before[::-1][step - 1 :: step][::-1]
        return replace(self.cut(slice(None, None, step)), before=before)

    def cut(self, at: slice) -> Signals:
        """Some of the instants; nothing is known of before."""
        series = {name: getattr(self, name)[at] for name in ("t", "q", "v", "a", "load", "torque")}
        others = {name: values[at] for name, values in self.covariates.items()}
        laden = None if self.laden is None else self.laden.cut(at)
        return replace(
            self, **series, body=self.body.cut(at), covariates=others, before=None, laden=laden
        )

    def with_covariate(self, name: str) -> Signals:
        """The same with that column of the log alone."""
        return replace(self, covariates={name: self.covariates[name]})

    def rate(self, x: Array) -> Array:
        """dx/dt by central differences along the first axis."""
        if len(self.t) < 3:
            return np.zeros_like(x)
        return np.gradient(x, float(self.t[1] - self.t[0]), axis=0)

    def rate_back(self, w: Array) -> Array:
        """The transpose of `rate`: the cotangent of x for a cotangent w of dx/dt."""
        if len(self.t) < 3:
            return np.zeros_like(w)
        h = float(self.t[1] - self.t[0])
        back = np.zeros_like(w)
        back[2:] += w[1:-1] / (2 * h)
        back[:-2] -= w[1:-1] / (2 * h)
        back[1] += w[0] / h
        back[0] -= w[0] / h
        back[-1] += w[-1] / h
        back[-2] -= w[-1] / h
        return back

    def only(self, joint: int, x: Array) -> Array:
        """Zeros (T, n) with x (T,) in the column of `joint`."""
        full = np.zeros_like(self.q)
        full[:, joint] = x
        return full


@dataclass
class Cotangents:
    """Derivatives of a scalar with respect to what columns depend on, each (T, n) or None.

    `regressor` is (T, n, 10·n_bodies), for effects whose columns are entries of Y.
    """

    q: Array | None = None
    v: Array | None = None
    a: Array | None = None
    load: Array | None = None
    torque: Array | None = None
    regressor: Array | None = None

    def add_to(self, states: Array, torques: Array) -> None:
        """Add those by q, v, a to `states` (3, T, n), those by load and torque to `torques`."""
        for order, direct in enumerate((self.q, self.v, self.a)):
            if direct is not None:
                states[order] += direct
        for through in (self.load, self.torque):
            if through is not None:
                torques += through
