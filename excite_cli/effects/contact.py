"""Contact: an external force f on a link during a window of time in one run.

The motors must add −Jᵀ f, with J the linear Jacobian of a joint's frame in axes of the world. The
parameters are the force on the robot. It acts at the frame of the last of the effect's joints,
which are those that it may load; people push an arm at its elbow as well as at its end.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import (
    Abscissa,
    Effect,
    Parameter,
    Scope,
    Signals,
    Tier,
    steps_by_ratio,
)
from excite_cli.effects.judgement import Seen
from excite_cli.effects.mechanism import all_joints, real, reals
from excite_cli.effects.simulated_robot import Push, SimulatedRobot
from excite_cli.robot.model import Array, Robot

_CELLS = 96  # per run, for the search of the window
_LOOKED_AT = 1500  # instants of it, at most: a window is found to a sixteenth of a cell
_SHORTEST = 0.1  # s: what is shorter is a blow or a fault of the record
_LEAST = 0.1  # N
_LONGEST = 0.5  # of the run; what lasts longer is no touch
_FELT = 2  # joints above a frame by which a force on it is told


class Contact(Effect):
    """A force (fx, fy, fz) on a link from `start` to `end`, in axes of the world."""

    kind: ClassVar = "contact"
    over_time: ClassVar = True
    title: ClassVar = "contact with the surroundings"
    signature: ClassVar = "residuals on many joints that appear at one instant and go at another"
    scope: ClassVar[Scope] = "robot"
    parameters: ClassVar = (
        Parameter("fx", "N", 1.0, 300.0),
        Parameter("fy", "N", 1.0, 300.0),
        Parameter("fz", "N", 1.0, 300.0),
    )
    shapes: ClassVar = (Parameter("start", "s", 0.0, 1e4), Parameter("end", "s", 0.0, 1e4))
    defaults: ClassVar[Mapping[str, float]] = {"start": 1.0, "end": 2.0}
    per_run: ClassVar = True
    prior_cost: ClassVar = (
        60.0  # three forces in a window of one's choice explain any event a little
    )
    tier: ClassVar = Tier.LAST
    picture: ClassVar = "window"
    excitable: ClassVar = False
    why_not_excitable: ClassVar = "a touch happens in one run; the next motion does not repeat it"

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """All joints, and those down to each frame that moves with two others at least.

        What one joint alone feels is any torque.
        """
        chains = (_down_to(robot, j) for j in range(robot.n - 1))
        return [tuple(range(robot.n)), *(chain for chain in chains if len(chain) > _FELT)]

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Windows of 1/2, 1/4, 1/8 and 1/16 of each run, each half over the one before."""
        return [
            {"start": float(s.t[0] + i / parts / 2 * span), "end": float(s.t[0] + last * span)}
            for s in signals
            for span in [float(s.t[-1] - s.t[0])]
            for parts in (2, 4, 8, 16)
            for i in range(2 * parts - 1)
            for last in [(i + 2) / parts / 2]
        ]

    @classmethod
    def tuned(
        cls,
        robot: Robot,
        joints: tuple[int, ...],
        signals: Sequence[Signals],
        residuals: Sequence[Array],
    ) -> list[dict]:
        """The window of each run in which a constant force explains most of the residual."""
        own = list(joints)
        found = [
            _window(s, np.asarray(r)[:, own], joints)
            for s, r in zip(signals, residuals, strict=True)
        ]
        best = sorted((each for each in found if each is not None), key=lambda each: -each[0])
        return [{"start": start, "end": end} for _, start, end in best if end - start > _SHORTEST]

    def shapes_near(self, signals: Sequence[Signals]) -> list[dict]:
        """Windows that are not too long to be a touch."""
        longest = _LONGEST * max(float(s.t[-1] - s.t[0]) for s in signals)
        near = super().shapes_near(signals)
        return [each for each in near if each["end"] - each["start"] <= longest]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """Parts of the window's length."""
        length = max(abs(self.shape["end"] - self.shape["start"]), 0.05)
        return steps_by_ratio(length, self.finer_ratios)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A force on the frame while it lasts."""
        start, end = numbers["start"], numbers["end"]
        robot.pushes.append(Push(np.array(values), start, end, self.joints[-1]))

    def columns(self, signals: Signals) -> Array:
        """−Jᵀ within the window, else zero, (T, len(joints), 3)."""
        inside = (signals.t >= self.shape["start"]) & (signals.t <= self.shape["end"])
        columns = np.zeros((len(signals.t), len(self.joints), 3))
        if inside.any():
            columns[inside] = _columns(signals, inside, self.joints)
        return columns

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """−Jᵀ f within the window."""
        start, end = real(self.shape["start"]), real(self.shape["end"])
        force = reals(-np.asarray(values))
        push = all_joints(f"pushed({self.joints[-1]}, (const real[3]){{{force}}}, q, out)")
        return f"if (t >= {start} && t <= {end}) {push}"

    def absurd(self, values: Array, seen: Seen) -> str:
        """A touch that nobody feels is none."""
        force = float(np.linalg.norm(values))
        return f"a force of {force:.2g} N is no touch" if force < _LEAST else ""

    def abscissa(self, signals: Signals) -> Abscissa:
        """Time: the touch begins and ends."""
        return Abscissa("time", "s", signals.t)


def _down_to(robot: Robot, joint: int) -> tuple[int, ...]:
    """The joints that carry one, from the base on, and itself."""
    chain = [joint]
    while robot.parents[chain[-1]] >= 0:
        chain.append(robot.parents[chain[-1]])
    return tuple(reversed(chain))


def _columns(signals: Signals, at: NDArray[np.bool_] | slice, joints: tuple[int, ...]) -> Array:
    body = signals.body
    part = RigidBody(body.robot, body.phi, signals.q[at], signals.v[at], signals.a[at])
    return -np.swapaxes(part.frame_jacobian(joints[-1])[:, :3, list(joints)], 1, 2)


def _window(
    signals: Signals, residual: Array, joints: tuple[int, ...]
) -> tuple[float, float, float] | None:
    """Energy explained, start and end of the best window, all pairs of two grids."""
    step = max(1, len(signals.t) // _LOOKED_AT)
    signals, residual = signals.every(step), residual[::step]
    count = len(signals.t)
    if count < 16:
        return None
    # Rows count by their own noise, so that a large joint does not drown a wrist.
    scale = np.median(np.abs(residual - np.median(residual, axis=0)), axis=0)
    scale = np.maximum(scale, 1e-6 * np.abs(residual).max() + 1e-12)
    columns, r = _columns(signals, slice(None), joints) / scale[:, None], residual / scale
    gram = _sums(np.einsum("tri,trj->tij", columns, columns))
    moment = _sums(np.einsum("tri,tr->ti", columns, r))
    edges = np.unique(np.linspace(0, count, min(_CELLS, count) + 1).astype(int))
    _, start, end = _best(gram, moment, edges, edges)
    near = int(np.ceil(count / _CELLS))
    around = [
        np.unique(np.clip(np.linspace(at - near, at + near, 33).astype(int), 0, count))
        for at in (start, end)
    ]
    energy, start, end = _best(gram, moment, *around)
    return energy, float(signals.t[start]), float(signals.t[end - 1])


def _sums(x: Array) -> Array:
    return np.concatenate([np.zeros_like(x[:1]), np.cumsum(x, axis=0)])


def _best(gram: Array, moment: Array, starts: Array, ends: Array) -> tuple[float, int, int]:
    """The window [start, end) with the largest bᵀ A⁻¹ b, at most half of the run."""
    first, last = (x.ravel() for x in np.meshgrid(starts, ends, indexing="ij"))
    length = last - first
    fits = (length >= 2) & (length <= _LONGEST * (len(gram) - 1))
    first, last = first[fits], last[fits]
    a, b = gram[last] - gram[first], moment[last] - moment[first]
    ridge = 1e-9 * np.einsum("kii->k", gram[-1:])[0] / len(gram)
    a = a + (ridge + 1e-300) * np.eye(3)
    energy = np.einsum("ki,ki->k", b, np.linalg.solve(a, b[:, :, None])[:, :, 0])
    k = int(np.argmax(energy))
    return float(energy[k]), int(first[k]), int(last[k])
