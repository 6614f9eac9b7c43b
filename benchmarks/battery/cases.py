"""Cases of the battery: robot, motions, instruments, declared model, and what is planted.

A case follows from (seed, index) alone. Cases come in decks of 36: every kind of the catalogue
once, seven clean ones, two outside the catalogue, three with two effects, two that are absorbed; a
deck is shuffled by its seed. Friction with memory is in cases of its own: two of three are Dahl's,
on one joint or on two.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.battery.instruments import Instruments
from benchmarks.battery.motions import FRICTION, ROBOTS, Arm, arm, four_motions
from benchmarks.battery.outside import HISTORY, OUTSIDE
from benchmarks.battery.scoring import Name, Plant
from benchmarks.battery.sizes import Ground, Sized, ground_of, size
from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.spec import Spec
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, declared_effects, kind_named
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import true_inertias
from excite_cli.simulation.ground_truth import PlantedEffect, sized
from excite_cli.simulation.planned_motion import Planned, PlannedMotion
from excite_cli.simulation.settings import SimulationSettings

_DECLARED = 0.65  # of the cases
_ROBOT_SHARES = (0.45, 0.38, 0.17)
_SHOWS = 1e-3  # share of an effect's energy that the declared model must leave, to be looked for
_ABSORBED = 1e-6  # below it nothing is left
_SEPARATE = 0.02  # share of the second of two effects that the first one must leave
_ALONE = ("payload", "contact", "torque_delay", "base_tilt", "backlash")  # not as one of two
_HIDDEN = ("armature", "encoder_offset", "torque_gain", "torque_offset", "spring", "elasticity")
_ATTEMPTS = 80


@dataclass(frozen=True)
class Case:
    """All that recording, diagnosing and judging need. `spec` holds the declared model.

    `plants`: everything that is in the robot and not declared; `visible`: of each the share of its
    energy that the declared model leaves. `friction`: plain friction is "declared", "undeclared"
    (in the robot, to be found) or "none". `data`: what was recorded already, in place of motions.
    """

    index: int
    group: str
    robot: Arm
    motions: tuple[Planned, ...]
    settings: SimulationSettings
    spec: Spec
    plants: tuple[Plant, ...]
    friction: str
    visible: tuple[float, ...] = ()
    instruments: Instruments | None = None
    hidden: tuple[PlantedEffect, ...] = ()
    held_out: str | None = None
    data: Dataset | None = None
    words: str = ""

    @property
    def runs(self) -> tuple[str, ...]:
        return tuple(motion.name for motion in self.motions)

    @property
    def planted(self) -> tuple[PlantedEffect, ...]:
        """What the simulated robot has beside what is declared."""
        return (*(p for plant in self.plants for p in plant.effects), *self.hidden)


def sized_case(
    index: int, group: str, of: Arm, motions: Sequence[PlannedMotion],
    settings: SimulationSettings, friction: tuple[EffectSpec, ...], planted: Sequence[Sized],
    shows: Sequence[float],
) -> Case:  # fmt: skip
    """A case of effects that have their sizes."""
    spec = of.spec.model_copy(update={"effects": friction})
    plants = tuple(plant_of(one, of.robot) for one in planted)
    words = "declared" if friction else "none"
    return Case(index, group, of, tuple(motions), settings, spec, plants, words, tuple(shows))


def plant_of(one: Sized, robot: Robot) -> Plant:
    """The effect as it is scored."""

    def name(planted: PlantedEffect) -> Name:
        return Name(planted.effect.kind, tuple(robot.joint_names[j] for j in planted.effect.joints))

    own = name(one.planted)
    return Plant(
        (own.kind,), own.joints, (one.planted, *one.companions),
        companions=tuple(map(name, one.companions)),
        touched=tuple(robot.joint_names[j] for j in one.touched),
        strongest=robot.joint_names[one.strongest], ratio=one.ratio,
    )  # fmt: skip


Label = Callable[[int, int], tuple[str, str]]


# Later than the deck, whose draws stay.
_LATER = ("gear_loss", "torque_crosstalk", "coupled_armature")


@cache
def kinds() -> tuple[str, ...]:
    """Kinds that four recordings of one robot show and that have no cases of their own."""
    own = {*_LATER, *(kind.kind for kind in HISTORY.values())}
    return tuple(
        name
        for name, kind in catalogue().items()
        if not (kind.of_campaign or kind.follows_covariate or kind.scope == "base" or name in own)
    )


@cache
def _deck(seed: int, number: int) -> tuple[tuple[str, str], ...]:
    """Group and kind of 36 cases; kinds of several effects are drawn with the case."""
    cards: list[tuple[str, str]] = [("one", kind) for kind in kinds()]
    for k in range(number, number + 7):
        cards.append(("clean", ("any", "correlated")[k % 2]))
    for k in range(2):
        cards.append(("outside", OUTSIDE[(2 * number + k) % len(OUTSIDE)].kind))
    cards.extend([("two", "")] * 3)
    cards.extend([("absorbed", "")] * 2)
    order = np.random.default_rng([seed, 36, number]).permutation(len(cards))
    return tuple(cards[i] for i in order)


def label(seed: int, index: int) -> tuple[str, str]:
    """Group and kind of a case, without making it."""
    length = len(kinds()) + 14
    return _deck(seed, index // length)[index % length]


def label_of_history(seed: int, index: int) -> tuple[str, str]:
    """As `label`, of cases of friction with memory."""
    return "history", ("dahl_by_speed", "dahl_by_speed", "maxwell_slip")[index % 3]


def make_case(seed: int, index: int, labelled: Label = label) -> Case:
    """The case of a seed and an index."""
    group, kind = labelled(seed, index)
    rng = np.random.default_rng([seed, 1, index])
    return first_made(lambda: _attempt(seed, index, group, kind, rng))


def first_made(attempt: Callable[[], Case | None]) -> Case:
    """The case of the first attempt that makes one.

    Raises
    ------
    RuntimeError
        None of them does.
    """
    for _ in range(_ATTEMPTS):
        case = attempt()
        if case is not None:
            return case
    raise RuntimeError(f"no case in {_ATTEMPTS} attempts")


def _attempt(seed: int, index: int, group: str, kind: str, rng: np.random.Generator) -> Case | None:
    of = arm(str(rng.choice(ROBOTS, p=_ROBOT_SHARES)))
    with_friction = rng.uniform() < _DECLARED
    if kind in ("viscous_friction", "coulomb_friction"):
        with_friction = False
    if group == "outside" and kind != "outside:torque_hysteresis":
        with_friction = True  # else their friction would be half right a name
    motions = four_motions(of.name, seed, rng)
    settings = settings_of(rng, kind == "correlated")
    friction = FRICTION if with_friction else ()
    ground, model = ground_and_model(of, motions, settings, friction)
    planted = _planted(group, kind, of, ground, model, with_friction, rng)
    if planted is None:
        return None
    shows = tuple(left_over(model, one, ground) for one in planted)
    return sized_case(index, group, of, motions, settings, friction, planted, shows)


def ground_and_model(
    of: Arm,
    motions: Sequence[PlannedMotion],
    settings: SimulationSettings,
    friction: tuple[EffectSpec, ...] | None,
) -> tuple[Ground, Array]:
    """What sizes are measured on, and a basis of what the declared model explains there."""
    declared = declared_effects(friction, of.robot)
    phi = true_inertias(of.robot, settings.inertia_error, settings.seed)
    known = sized(of.robot, declared, settings.seed)
    ground = ground_of(of.robot, phi, motions, known, settings.torque_noise)
    return ground, model_columns(of, declared, ground)


def settings_of(rng: np.random.Generator, correlated: bool) -> SimulationSettings:
    """Noise and encoders, drawn."""
    correlation = 0.0
    if correlated:
        correlation = rng.uniform(0.8, 0.95)
    elif rng.uniform() < 0.5:
        correlation = rng.uniform(0.5, 0.95)
    return SimulationSettings(
        seed=int(rng.integers(2**31)),
        torque_noise=float(np.exp(rng.uniform(np.log(0.005), np.log(0.02)))),
        noise_correlation=float(correlation),
        encoder=float(2 * np.pi / 2 ** rng.integers(16, 21)),
    )


def _planted(
    group: str, kind: str, of: Arm, ground: Ground, model: Array, with_friction: bool,
    rng: np.random.Generator,
) -> tuple[Sized, ...] | None:  # fmt: skip
    if group == "clean":
        return ()
    if group == "history":
        return _history(HISTORY[kind], of, ground, model, rng)
    if group == "two":
        return _two(of, ground, model, with_friction, rng)
    shows = {"outside": (0.05, np.inf), "absorbed": (-1.0, _ABSORBED)}.get(group, (_SHOWS, np.inf))
    outside = {each.kind: each for each in OUTSIDE}
    for name in map(str, rng.permutation(_HIDDEN) if group == "absorbed" else [kind]):
        found = one_effect(outside.get(name) or kind_named(name), of, ground, model, shows, rng)
        if found is not None:
            return (found,)
    return None


def _history(
    kind: type[Effect], of: Arm, ground: Ground, model: Array, rng: np.random.Generator
) -> tuple[Sized, ...] | None:
    """On one joint, or on two in a quarter of the cases, where it is no plain friction."""
    plain = declared_effects(FRICTION, of.robot)
    columns = [weighted_columns(effect, ground) for effect in plain]
    around = orthonormal(np.hstack([model, *columns]))
    found: list[Sized] = []
    for at in rng.permutation(of.robot.n):
        one = size(kind, (int(at),), ground, rng)
        if one is None or one.ratio**2 * left_over(around, one, ground) < ground.noise**2:
            continue
        found.append(one)
        if len(found) == 2 or rng.uniform() > 0.25:
            return tuple(found)
    return tuple(found) or None


def one_effect(
    kind: type[Effect], of: Arm, ground: Ground, model: Array, shows: tuple[float, float],
    rng: np.random.Generator,
) -> Sized | None:  # fmt: skip
    """The kind at the first of its places, in random order, where it fits."""
    places = kind.places(of.robot)
    order = rng.permutation(len(places))
    if kind.kind == "torque_delay" and rng.uniform() < 0.5:  # all joints together
        order = np.concatenate([[0], order[order != 0]])
    for at in order:
        found = size(kind, places[at], ground, rng)
        if found is not None and shows[0] <= left_over(model, found, ground) < shows[1]:
            return found
    return None


def _two(
    of: Arm, ground: Ground, model: Array, with_friction: bool, rng: np.random.Generator
) -> tuple[Sized, ...] | None:
    """Two effects of different kinds, on one joint in half of the cases, that can be told apart."""
    excluded = set(_ALONE)
    if with_friction:
        excluded |= {"viscous_friction", "coulomb_friction"}
    names = [name for name in kinds() if name not in excluded]
    first_name, second_name = rng.choice(names, 2, replace=False)
    first = one_effect(kind_named(str(first_name)), of, ground, model, (_SEPARATE, np.inf), rng)
    if first is None:
        return None
    second_kind = kind_named(str(second_name))
    places = second_kind.places(of.robot)
    if rng.uniform() < 0.5:
        places = [place for place in places if set(place) & set(first.touched)]
    beside_first = beside(model, [first], ground)
    for at in rng.permutation(len(places)):
        second = size(second_kind, places[at], ground, rng)
        if second is None or left_over(beside_first, second, ground) < _SEPARATE:
            continue
        if left_over(beside(model, [second], ground), first, ground) >= _SEPARATE:
            return first, second
    return None


def beside(model: Array, others: Sequence[Sized], ground: Ground) -> Array:
    """Basis of what the model and other effects explain."""
    columns = [weighted_columns(each.planted.effect, ground) for each in others]
    return orthonormal(np.hstack([model, *columns]))


def model_columns(of: Arm, declared: Sequence[Effect], ground: Ground) -> Array:
    """Orthonormal basis of what base parameters and declared effects explain.

    Rows are in units of their joint's torque, as the noise is.
    """
    inertial = np.concatenate([s.body.regressor[:, :, of.base.selection] for s in ground.signals])
    flat = (inertial * _weights(ground)[:, None]).reshape(-1, of.base.rank)
    return orthonormal(
        np.hstack([flat, *(weighted_columns(effect, ground) for effect in declared)])
    )


def orthonormal(columns: Array) -> Array:
    """Basis of the columns' span; columns of zeros are left out."""
    norms = np.linalg.norm(columns, axis=0)
    columns = columns[:, norms > 1e-12 * norms.max()] / norms[norms > 1e-12 * norms.max()]
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, sizes > 1e-9 * sizes[0]]


def weighted_columns(effect: Effect, ground: Ground) -> Array:
    """Torque per parameter over all motions, (T·n, P), in units of each joint's torque."""
    n = ground.robot.n
    rows, count = list(effect.rows(n)), len(effect.parameters)
    found = []
    for s in ground.signals:
        full = np.zeros((len(s.t), n, count))
        if effect.active(s.run):
            full[:, rows] = effect.columns(s)
        found.append(full)
    return (np.concatenate(found) * _weights(ground)[:, None]).reshape(-1, count)


def left_over(model: Array, one: Sized, ground: Ground) -> float:
    """Share of the effect's energy that the model, an orthonormal basis, does not explain."""
    planted = one.planted
    torque = np.concatenate([planted.effect.torque(s, planted.values) for s in ground.signals])
    y = (torque * _weights(ground)).ravel()
    left = y - model @ (model.T @ y)
    return float(left @ left / max(float(y @ y), 1e-300))


def _weights(ground: Ground) -> Array:
    return 1.0 / np.maximum(ground.torque, 1e-3 * ground.torque.max())
