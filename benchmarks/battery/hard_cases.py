"""Cases in which a search goes wrong: effects that hide, imitate, or stand for each other.

A case follows from (seed, index) alone; topics come in turn, shuffled by the seed. The robot, its
noise and its motions are those of the other cases (`cases`); what differs is what is planted and
how many motions there are, the last of which is held out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.battery.cases import (
    Case,
    beside,
    first_made,
    ground_and_model,
    left_over,
    settings_of,
    sized_case,
)
from benchmarks.battery.motions import FRICTION, Arm, arm, four_motions
from benchmarks.battery.outside import RubbingSector
from benchmarks.battery.sizes import Ground, Sized, sized_as
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.model import Array

_SHOWS = 0.02  # share of an effect's energy that the model and the other effects must leave


def label(seed: int, index: int) -> tuple[str, str]:
    """Group and topic of a case, without making it."""
    order = np.random.default_rng([seed, 37, index // len(TOPICS)]).permutation(len(TOPICS))
    return "hard", list(TOPICS)[order[index % len(TOPICS)]]


def make_case(seed: int, index: int) -> Case:
    """The case of a seed and an index."""
    topic = label(seed, index)[1]
    rng = np.random.default_rng([seed, 2, index])
    return first_made(lambda: _attempt(seed, index, topic, rng))


def _attempt(seed: int, index: int, topic: str, rng: np.random.Generator) -> Case | None:
    of = arm(str(rng.choice(_ROBOTS.get(topic, ("ur10", "panda")))))
    motions = four_motions(of.name, seed, rng)
    motions = motions[: int(rng.choice(_MOTIONS.get(topic, (4,))))]
    settings = settings_of(rng, correlated=topic == "constant")
    friction = FRICTION if rng.uniform() < _DECLARED.get(topic, 0.5) else ()
    ground, model = ground_and_model(of, motions, settings, friction)
    drawn = TOPICS[topic](of, ground, rng)
    planted = [one for one in drawn if one is not None]
    if len(planted) < len(drawn) or not _separate(planted, ground, model):
        return None
    shows = tuple(left_over(model, one, ground) for one in planted)
    return sized_case(index, "hard", of, motions, settings, friction, planted, shows)


def _separate(planted: Sequence[Sized], ground: Ground, model: Array) -> bool:
    """Whether every effect shows beside the model and all others, and in the noise."""
    for one in planted:
        rest = [other for other in planted if other is not one]
        left = left_over(beside(model, rest, ground), one, ground)
        if left < _SHOWS or np.sqrt(left) * one.ratio < ground.noise:
            return False
    return True


Drawn = list[Sized | None]  # None has no size, and the case is drawn anew


def _bent_spring(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """A spring and friction that grows with the square of speed, on one joint."""
    j = int(rng.integers(of.robot.n))
    middle = float(np.mean([s.q[:, j].mean() for s in ground.signals]))
    spring = _one("spring", (j,), {}, [1.0, -middle - 0.3 * rng.normal()], ground, rng)
    bent = _one("nonlinear_viscous_friction", (j,), {"power": 2.0}, [1.0], ground, rng)
    return [spring, bent]


def _strong_refinement(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """Friction that grows with load, and none besides, much larger than anything else."""
    j = int(rng.integers(of.robot.n))
    return [_one("load_dependent_friction", (j,), {}, [1.0], ground, rng, (0.1, 0.4))]


def _many_frictions(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """Coulomb and viscous friction on most joints, and one that grows with load."""
    found = [
        _one(each.kind, (j,), {}, [1.0], ground, rng, (0.03, 0.2))
        for j in range(of.robot.n)
        for each in FRICTION
        if rng.uniform() < 0.6
    ]
    j = int(rng.integers(of.robot.n))
    return [*found, _one("load_dependent_friction", (j,), {}, [1.0], ground, rng, (0.05, 0.2))]


def _gears(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """Coupled gears with dry friction alone, viscous alone, or both."""
    places = kind_named("coupled_friction").places(of.robot)
    place = places[int(rng.integers(len(places)))]
    parts = [(0.0, 1.0), (1.0, 0.0), (1.0, rng.uniform(0.3, 3.0))][int(rng.integers(3))]
    shape = {"direction": float(rng.choice([-1.0, 1.0]))}
    return [_one("coupled_friction", place, shape, parts, ground, rng)]


def _constant(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """A constant, in noise with a long memory, or beside friction that changes with the angle.

    The friction is dry, viscous, or in one sector and without a name: then it is taken for noise
    with a longer memory still.
    """
    j = int(rng.integers(of.robot.n))
    sign = rng.choice([-1.0, 1.0])
    found = _one("torque_offset", (j,), {}, [sign], ground, rng, (0.05, 0.3))
    if found is None or rng.uniform() < 0.5:
        return [found]
    share = rng.uniform(0.3, 0.6) * found.ratio
    if rng.uniform() < 0.4:
        q = np.concatenate([s.q[:, j] for s in ground.signals])
        sector = {
            "centre": float(rng.uniform(*np.quantile(q, [0.2, 0.8]))),
            "width": float(rng.uniform(0.1, 0.3) * np.ptp(q)),
        }
        other = sized_as(RubbingSector((j,), sector), np.ones(1), share, ground)
        return [None if other is None else replace(found, companions=(other.planted,))]
    turn = float(rng.uniform(0.0, 2 * np.pi))
    # f sin²(q + φ) = f/2 (1 − cos(2q + 2φ)): what changes, and its mean over a turn
    shape = {"periods": 2.0, "power": float(rng.integers(2))}
    uneven = kind_named("position_friction")((j,), shape)
    return [
        found,
        sized_as(uneven, np.array([-np.cos(turn), np.sin(turn)]), share / 2**0.5, ground),
    ]


def _slow_ripple(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """A ripple of two to six periods per turn."""
    j = int(rng.integers(of.robot.n))
    turn = rng.uniform(0, 2 * np.pi)
    shape = {"periods": float(rng.integers(2, 7))}
    return [_one("ripple", (j,), shape, [np.cos(turn), np.sin(turn)], ground, rng)]


def _shared_delay(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """One delay for all joints, or for those of an arm."""
    n = of.robot.n
    joints = tuple(range(n))
    if of.name == "talos_arms" and rng.uniform() < 0.7:
        half = n // 2
        joints = joints[:half] if rng.uniform() < 0.5 else joints[half:]
    delay = float(np.exp(rng.uniform(*np.log((3e-3, 15e-3)))))
    return [sized_as(kind_named("torque_delay")(joints, {}), np.array([delay]), None, ground)]


def _whole_gain(of: Arm, ground: Ground, rng: np.random.Generator) -> Drawn:
    """A wrong gain of a joint that has much friction."""
    j = int(rng.integers(of.robot.n))
    gain = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(*np.log((0.04, 0.15)))))
    rubs = [_one(each.kind, (j,), {}, [1.0], ground, rng, (0.15, 0.35)) for each in FRICTION]
    return [sized_as(kind_named("torque_gain")((j,), {}), np.array([gain]), None, ground), *rubs]


def _one(
    kind: str, joints: tuple[int, ...], shape: Mapping[str, float], direction: Sequence[float],
    ground: Ground, rng: np.random.Generator, ratio: tuple[float, float] = (0.04, 0.30),
) -> Sized | None:  # fmt: skip
    """An effect of random size in that direction, a share of the joint's torque."""
    effect: Effect = kind_named(kind)(joints, shape)
    wanted = float(np.exp(rng.uniform(*np.log(ratio))))
    return sized_as(effect, np.asarray(direction, dtype=float), wanted, ground)


TOPICS: Mapping[str, Callable[[Arm, Ground, np.random.Generator], Drawn]] = {
    "bent_spring": _bent_spring,
    "strong_refinement": _strong_refinement,
    "many_frictions": _many_frictions,
    "gears": _gears,
    "constant": _constant,
    "slow_ripple": _slow_ripple,
    "shared_delay": _shared_delay,
    "whole_gain": _whole_gain,
}
_ROBOTS = {"shared_delay": ("talos_arms", "ur10"), "gears": ("ur10", "panda")}
# Of how many motions, each as likely; a single one is cut into blocks.
_MOTIONS = {
    "bent_spring": (1, 1, 2, 4),
    "strong_refinement": (1, 2),
    "constant": (1, 2, 4),
    "slow_ripple": (1, 2, 4),
}
_DECLARED = {"bent_spring": 1.0, "strong_refinement": 0.0, "many_frictions": 0.0, "whole_gain": 0.0}
