"""How large an effect is planted: random, physically sensible, and measured on the motions.

`ratio` is the RMS of the effect's torque over the RMS of the joint's torque, on the joint where it
is largest; of a touch, within its window.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.planned_motion import Planned

RATIOS = (0.03, 0.30)
NEAR_NOISE = (1.5, 3.0)  # times the noise's RMS
_NEAR_SHARE = 0.25  # of the cases
_ACCEPTED = (0.9, 0.40)  # least, in units of 1.5 × noise or 3 %; and largest ratio
_STRIBECK_EXCESS = 0.4  # at most, of the joint's torque RMS
_STRIBECK_SPEEDS = (0.03, 0.3)  # rad/s
_DAHL_DISTANCES = (0.01, 0.2)  # rad
_SAMPLES = 250

# Kinds that say their size themselves: low, high of the first number.
_OWN_SIZE = {
    "torque_delay": (2e-3, 15e-3),
    "torque_gain": (0.03, 0.15),
    "base_tilt": (0.01, 0.05),
    "encoder_offset": (0.01, 0.05),
}


@dataclass(frozen=True)
class Ground:
    """What sizes are measured on: signals of all motions at the robot's true inertias.

    `torque` (n,) is the RMS with the declared effects; `friction` (n,) the declared dry one.
    """

    robot: Robot
    signals: tuple[Signals, ...]
    torque: Array
    friction: Array
    noise: float

    @property
    def runs(self) -> tuple[str, ...]:
        return tuple(s.run.name for s in self.signals)


def ground_of(
    robot: Robot,
    phi: Array,
    motions: Sequence[Planned],
    declared: Sequence[PlantedEffect],
    noise: float,
) -> Ground:
    """Signals of the motions with the torque of what is declared."""
    found, friction = [], np.zeros(robot.n)
    for motion in motions:
        t = np.linspace(0.0, motion.duration, _SAMPLES)
        q, v, a = motion.states(t)
        body = RigidBody(robot, phi, q, v, a)
        bare = Signals(t, q, v, a, body.load, body.load, body, RunId(motion.name))
        torque = body.load + sum(p.effect.torque(bare, p.values) for p in declared)
        found.append(Signals(t, q, v, a, body.load, torque, body, RunId(motion.name)))
    for p in declared:
        if p.effect.kind == "coulomb_friction":
            friction[list(p.effect.joints)] += p.values[0]
    every = np.concatenate([s.torque for s in found])
    return Ground(robot, tuple(found), _rms(every), friction, noise)


@dataclass(frozen=True)
class Sized:
    """An effect in the robot; `companions` come with it by nature and need not be found."""

    planted: PlantedEffect
    ratio: float
    strongest: int
    touched: tuple[int, ...]
    companions: tuple[PlantedEffect, ...] = ()


def size(
    kind: type[Effect], joints: tuple[int, ...], ground: Ground, rng: np.random.Generator
) -> Sized | None:
    """An effect of a random size there; None where no sensible size shows."""
    wanted = _wanted(ground, rng)
    runs, shape, direction = _draw(kind, joints, ground, rng)
    effect = kind(joints, shape, runs)
    if kind.kind in _OWN_SIZE:
        values = _own_size(kind.kind, rng)
    elif kind.kind == "payload":
        moved = sum(float(m) for m in ground.signals[0].body.phi[::10])
        low, high = kind.parameters[0].low, kind.parameters[0].high
        mass = float(np.clip(rng.uniform(0.03, 0.15) * moved, low, high))
        centre = dict(zip(("cx", "cy", "cz"), rng.uniform(-0.05, 0.1, 3), strict=True))
        _, values = kind.planted(mass, centre)
    elif kind.kind in ("torque_saturation", "backlash"):
        values = np.array([1.0])
    else:
        unit = float(ratios(effect, direction, ground).max())
        if not unit > 0.0:
            return None
        values = _within(kind, direction * wanted / unit, ground, joints)
    if kind.kind == "friction_drift":
        values = _warming(values, effect, ground)
    found = sized_as(effect, values, None, ground)
    return found if found is not None and _sensible(kind, found.ratio, ground) else None


def sized_as(effect: Effect, values: Array, ratio: float | None, ground: Ground) -> Sized | None:
    """An effect with these values, scaled to a `ratio` if one is given; None where none shows."""
    if ratio is not None:
        unit = float(ratios(effect, values, ground).max())
        if not unit > 0.0:
            return None
        values = values * ratio / unit
    shares = ratios(effect, values, ground)
    if not np.isfinite(shares).all() or not shares.max() > 0.0:
        return None
    touched = tuple(int(j) for j in np.flatnonzero(shares >= 0.1 * shares.max()))
    strongest = int(np.argmax(shares))
    return Sized(
        PlantedEffect(effect, values),
        float(shares.max()),
        strongest,
        touched,
        _companions(effect, values),
    )


def _wanted(ground: Ground, rng: np.random.Generator) -> float:
    near, share, times = rng.uniform(), rng.uniform(*np.log(RATIOS)), rng.uniform(*NEAR_NOISE)
    return times * ground.noise if near < _NEAR_SHARE else float(np.exp(share))


def _sensible(kind: type[Effect], ratio: float, ground: Ground) -> bool:
    least, largest = _ACCEPTED
    least *= min(NEAR_NOISE[0] * ground.noise, RATIOS[0])
    if kind.kind in ("backlash", "payload", "contact"):  # most of the time there is nothing of them
        largest = 1.0
    if kind.kind in ("viscous_friction", "coulomb_friction", "base_tilt", "encoder_offset"):
        largest = 0.6
    return least <= ratio <= largest


def _draw(
    kind: type[Effect], joints: tuple[int, ...], ground: Ground, rng: np.random.Generator
) -> tuple[tuple[str, ...], dict[str, float], Array]:
    """Runs, shape, and the direction of the linear parameters."""
    name, count = kind.kind, len(kind.parameters)
    q = np.concatenate([s.q[:, joints[0]] for s in ground.signals])
    torque = np.concatenate([s.torque[:, joints[0]] for s in ground.signals])
    signs = rng.choice([-1.0, 1.0], count)
    parts = rng.uniform(0.3, 1.0, count)
    direction = parts * np.where([p.nonnegative for p in kind.parameters], 1.0, signs)
    runs: tuple[str, ...] = ()
    shape: dict[str, float] = {}
    trained = ground.runs[:-1]
    if name == "spring":
        rest = rng.uniform(q.min(), q.max())
        direction = np.array([1.0, -rest])
    elif name == "asymmetric_friction":
        direction = rng.permutation([1.0, rng.uniform(0.2, 0.6)])
    elif name == "nonlinear_viscous_friction":
        shape = {"power": float(rng.choice([0.5, 2.0, 3.0]))}
    elif name == "stribeck_friction":
        shape = {"stribeck_speed": float(np.exp(rng.uniform(*np.log(_STRIBECK_SPEEDS))))}
    elif name == "dahl_friction":
        shape = {"distance": float(np.exp(rng.uniform(*np.log(_DAHL_DISTANCES))))}
    elif name == "position_friction":
        turn = rng.uniform(0.0, 2 * np.pi)
        shape, direction = (
            {"periods": float(rng.integers(1, 3)), "power": float(rng.integers(2))},
            np.array([np.cos(turn), np.sin(turn)]),
        )
    elif name == "coupled_friction":
        shape = {"direction": float(rng.choice([-1.0, 1.0]))}
    elif name == "torque_saturation":
        clipped = float(np.exp(rng.uniform(*np.log((0.03, 0.15)))))
        shape = {"level": float(np.quantile(np.abs(torque), 1.0 - clipped))}
    elif name == "ripple":
        least = max(5.0, 2.5 * 2 * np.pi / max(np.ptp(q), 1e-9))
        shape = {"periods": float(np.exp(rng.uniform(np.log(least), np.log(max(60.0, least)))))}
    elif name == "backlash":
        shape = {"gap": float(np.exp(rng.uniform(*np.log((2e-3, 2e-2)))))}
    elif name == "payload":
        alone = rng.uniform() < 0.5
        runs = (str(rng.choice(trained)),) if alone else ground.runs[1:]
    elif name == "contact":
        runs = (str(rng.choice(trained)),)
        direction = rng.normal(size=3)
        start = float(rng.uniform(1.0, 8.0))
        shape = {"start": start, "end": start + float(rng.uniform(0.3, 1.0))}
    elif name == "outside:rubbing_sector":
        shape = {
            "centre": float(rng.uniform(*np.quantile(q, [0.2, 0.8]))),
            "width": float(rng.uniform(0.1, 0.3) * np.ptp(q)),
        }
    elif name == "outside:hardening_spring":
        shape = {"rest": float(0.5 * (q.min() + q.max()) + 0.2 * rng.normal())}
    elif name == "outside:torque_hysteresis":
        shape = {"width": float(rng.uniform(0.2, 1.0) * ground.torque[joints[0]])}
    return runs, shape, direction


def _own_size(name: str, rng: np.random.Generator) -> Array:
    low, high = np.log(_OWN_SIZE[name])
    value, sign = float(np.exp(rng.uniform(low, high))), float(rng.choice([-1.0, 1.0]))
    turn = rng.uniform(0.0, 2 * np.pi)
    if name == "base_tilt":
        return value * np.array([np.cos(turn), np.sin(turn)])
    return np.array([value if name == "torque_delay" else sign * value])


def _within(kind: type[Effect], values: Array, ground: Ground, joints: tuple[int, ...]) -> Array:
    """Scaled as a whole until the largest number lies in its usual range."""
    values = np.asarray(values, dtype=float)
    if kind.kind == "friction_drift":
        return values
    low = np.array([p.low for p in kind.parameters])
    high = np.array([p.high for p in kind.parameters])
    if kind.kind == "stribeck_friction":
        high = np.minimum(high, _STRIBECK_EXCESS * ground.torque[list(joints)])
    sizes = np.maximum(np.abs(values), 1e-300)
    values = values * min(1.0, float((high / sizes).min()))
    return values * max(1.0, float((low / np.maximum(np.abs(values), 1e-300)).min()))


def _warming(values: Array, effect: Effect, ground: Ground) -> Array:
    """Friction falls where there is enough of it that is declared, and rises elsewhere."""
    longest = max(float(s.t[-1]) for s in ground.signals)
    falls = abs(values[0]) * longest < 0.8 * ground.friction[effect.joints[0]]
    if falls:
        return np.array([-abs(values[0]), 0.0])
    return np.abs(values)


def _companions(effect: Effect, values: Array) -> tuple[PlantedEffect, ...]:
    """Plain friction without which it would give energy.

    The joints' own viscous shares of a coupled shaft; the dry friction that has a memory, or that
    changes over a turn.
    """
    if effect.kind == "position_friction":
        mean = np.array([float(np.linalg.norm(values))])
        return (PlantedEffect(kind_named(effect.varied)(effect.joints), mean),)
    if effect.kind == "dahl_friction":
        return (PlantedEffect(kind_named("coulomb_friction")(effect.joints), np.array(values)),)
    coupled = effect.kind in ("coupled_friction", "outside:distant_coupling")
    if not coupled or values[0] == 0.0:
        return ()
    viscous = kind_named("viscous_friction")
    return tuple(PlantedEffect(viscous((j,)), np.array([abs(values[0])])) for j in effect.joints)


def ratios(effect: Effect, values: Array, ground: Ground) -> Array:
    """RMS of the effect over that of the torque (n,)."""
    parts = [effect.torque(s, values) for s in ground.signals]
    tau = np.concatenate(parts)
    if effect.kind == "contact":
        tau = tau[np.any(tau != 0.0, axis=1)]
        if not len(tau):
            return np.zeros(ground.robot.n)
    if effect.kind == "payload":
        tau = np.concatenate(
            [p for p, s in zip(parts, ground.signals, strict=True) if effect.active(s.run)]
        )
    return _rms(tau) / np.maximum(ground.torque, 1e-3 * ground.torque.max())


def _rms(x: Array) -> Array:
    return np.sqrt(np.mean(np.asarray(x) ** 2, axis=0))
