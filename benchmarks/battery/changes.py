"""Draws what changes between runs: payloads, friction, offsets, gains, touches, unknown maps.

Everything is measured on the motions: what the declared model leaves of it must be at least about
as large as the torque's noise on the joint where it is strongest, in the runs that have it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.battery.cases import left_over, one_effect, weighted_columns
from benchmarks.battery.motions import Arm
from benchmarks.battery.outside import MAPS, Carried, DirectionMap, map_shape, solid
from benchmarks.battery.scoring import Name, Plant
from benchmarks.battery.series import leaves
from benchmarks.battery.sizes import Ground, Sized, ratios
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.model import Array
from excite_cli.simulation.ground_truth import PlantedEffect

_SHOWS = 1.0  # RMS of what is left of an effect, in units of the noise's
_SEPARATE = 0.05  # share that the declared model and the other effects leave
_STRONGER = (0.25, 0.6)  # friction that changes, as a share of itself


@dataclass(frozen=True)
class Scene:
    """On what effects are planted: motions, and an orthonormal `model` of what is declared.

    `runs` in their order, the `held_out` one among them; `clock` in units of the whole campaign;
    `friction` (2, n): Coulomb and viscous friction of the joints; zero where there is none.
    """

    of: Arm
    ground: Ground
    model: Array
    runs: tuple[str, ...]
    held_out: str
    clock: tuple[float, ...]
    friction: Array

    @property
    def training(self) -> tuple[str, ...]:
        return tuple(run for run in self.runs if run != self.held_out)

    def names(self, joints: Sequence[int]) -> tuple[str, ...]:
        return tuple(self.of.robot.joint_names[j] for j in joints)


Draw = Callable[[Scene, np.random.Generator], Plant | None]


def shows(scene: Scene, planted: Sequence[PlantedEffect]) -> bool:
    """Whether enough of it is left by the declared model."""
    torque = np.concatenate(
        [sum(p.effect.torque(s, p.values) for p in planted) for s in scene.ground.signals]
    )
    active = np.any(torque != 0.0, axis=1)
    if not active.any():
        return False
    scale = np.maximum(scene.ground.torque, 1e-3 * scene.ground.torque.max())
    flat = (torque / scale).ravel()
    left = (flat - scene.model @ (scene.model.T @ flat)).reshape(torque.shape)
    rms = np.sqrt(np.mean(left[active] ** 2, axis=0))
    return bool(rms.max() >= _SHOWS * scene.ground.noise)


def some_runs(scene: Scene, rng: np.random.Generator) -> frozenset[str]:
    """Some of the training runs, not all; the held-out run with a chance of 0.4."""
    training = list(scene.training)
    count = int(rng.integers(1, max(len(training), 2)))
    chosen = {str(run) for run in rng.choice(training, min(count, len(training) - 1), False)}
    if rng.uniform() < 0.4:
        chosen.add(scene.held_out)
    return frozenset(chosen)


def one_run(scene: Scene, rng: np.random.Generator) -> frozenset[str]:
    """One of the training runs."""
    return frozenset({str(rng.choice(scene.training))})


def from_some_run(scene: Scene, rng: np.random.Generator) -> frozenset[str]:
    """All from some run on; at least one training run is before and one after."""
    at = int(rng.integers(1, len(scene.runs)))
    chosen = frozenset(scene.runs[at:])
    trained = chosen & set(scene.training)
    return chosen if 0 < len(trained) < len(scene.training) else one_run(scene, rng)


def payload(scene: Scene, rng: np.random.Generator, joint: int | None = None) -> Plant | None:
    """A sphere or a box with its centre off the axis, on the last leaf or on `joint`."""
    carrier = leaves(scene.of.robot)[-1] if joint is None else joint
    moved = float(np.sum(scene.ground.signals[0].body.phi[::10]))
    mass = float(np.clip(rng.uniform(0.03, 0.15) * moved, 0.1, 5.0))
    center = np.array([*rng.uniform(-0.08, 0.08, 2), rng.uniform(0.0, 0.15)])
    values = solid(mass, center, rng)
    runs = some_runs(scene, rng)
    planted = PlantedEffect(Carried((carrier,), {}, tuple(sorted(runs))), values)
    if not shows(scene, [planted]) or ratios(planted.effect, values, scene.ground).max() > 3.0:
        return None
    sizes = {"mass": values[0], "mx": values[1], "my": values[2], "mz": values[3]}
    return Plant(("payload",), scene.names((carrier,)), (planted,), runs, sizes=sizes)


def payload_on_leaf(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """On any leaf but the last, where there are several."""
    return payload(scene, rng, int(rng.choice(leaves(scene.of.robot)[:-1])))


def friction_trend(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """Coulomb, viscous or both fall exponentially over the campaign, as a robot warms up."""
    j = int(rng.integers(scene.of.robot.n))
    which = ((True, False), (False, True), (True, True))[rng.integers(3)]
    extra = rng.uniform(*_STRONGER) * np.exp(-np.array(scene.clock) / rng.uniform(0.2, 1.0))
    planted = [
        PlantedEffect(kind_named(kind)((j,), {}, (run,)), np.array([base[j] * stronger]))
        for kind, base, changes in zip(_PLAIN, scene.friction, which, strict=True)
        if changes
        for run, stronger in zip(scene.runs, extra, strict=True)
    ]
    changed = tuple(kind for kind, changes in zip(_PLAIN, which, strict=True) if changes)
    by_run = dict(zip(scene.runs, map(float, extra), strict=True))
    trained = [by_run[run] for run in scene.training]
    # What all runs have of it is plain friction: only what changes must show.
    varying = [
        replace(p, values=p.values * (by_run[p.effect.runs[0]] - np.mean(trained)) /
                by_run[p.effect.runs[0]])
        for p in planted
    ]  # fmt: skip
    if not shows(scene, varying):
        return None
    return Plant(changed, scene.names((j,)), tuple(planted), by_run=by_run)


def friction_step(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """Coulomb or viscous friction is another one from some run on."""
    return _other_friction(scene, from_some_run(scene, rng), rng)


def friction_once(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """Coulomb or viscous friction is another one in a single run."""
    return _other_friction(scene, one_run(scene, rng), rng)


def offset_change(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """The torque sensor has another zero in a run or from one on, as after re-homing."""
    return _in_runs("torque_offset", scene, rng)


def gain_change(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """The torque has another scale in a run or from one on."""
    return _in_runs("torque_gain", scene, rng)


def contact(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """A force on the tip for a part of a second to a second, in one run."""
    run = one_run(scene, rng)
    seconds = max(float(s.t[-1]) for s in scene.ground.signals if s.run.name in run)
    start = float(rng.uniform(0.5, seconds - 1.6))
    shape = {"start": start, "end": start + float(rng.uniform(0.4, 1.0))}
    effect = kind_named("contact")(tuple(range(scene.of.robot.n)), shape, tuple(run))
    direction = rng.normal(size=3)
    unit = float(ratios(effect, direction, scene.ground).max())
    if not unit > 0.0:
        return None
    values = direction * float(np.exp(rng.uniform(np.log(0.1), np.log(0.5)))) / unit
    planted = PlantedEffect(effect, values)
    if not shows(scene, [planted]):
        return None
    sizes = dict(zip(("fx", "fy", "fz"), map(float, values), strict=True))
    names = scene.names(range(scene.of.robot.n))
    return Plant(("contact",), names, (planted,), run, sizes=sizes)


def unknown_map(scene: Scene, rng: np.random.Generator) -> Plant | None:
    """A torque over two quantities that no kind of the catalogue is."""
    kind = MAPS[rng.integers(len(MAPS))]
    j, other = (int(x) for x in rng.choice(scene.of.robot.n, 2, replace=False))
    q = np.concatenate([s.q for s in scene.ground.signals])
    ranges = np.array([[q[:, i].min(), q[:, i].max()] for i in (j, other)])
    joints = (j,) if kind is DirectionMap and rng.uniform() < 0.3 else (j, other)
    effect = kind((j, joints[-1]), map_shape(kind, rng, ranges))
    unit = float(ratios(effect, np.ones(1), scene.ground).max())
    values = np.array([np.exp(rng.uniform(np.log(0.08), np.log(0.25))) / max(unit, 1e-12)])
    planted = PlantedEffect(effect, values)
    left = left_over(scene.model, Sized(planted, 0.0, j, (j,)), scene.ground)
    strong = replace(scene, ground=replace(scene.ground, noise=4 * scene.ground.noise))
    if left < 0.1 or not shows(strong, [planted]):
        return None
    return Plant((kind.kind,), scene.names((j,)), (planted,), nameable=False)


def of_catalogue(kind: str, scene: Scene, rng: np.random.Generator) -> Plant | None:
    """A kind of the catalogue, in all runs, where it fits."""
    wanted = (1e-2, np.inf)
    found = one_effect(kind_named(kind), scene.of, scene.ground, scene.model, wanted, rng)
    if found is None or not shows(scene, [found.planted]):
        return None
    return as_plant(scene, found)


def as_plant(scene: Scene, found: Sized) -> Plant:
    """With the sizes that people know it by."""
    effect, values = found.planted.effect, found.planted.values
    reported = effect.report(values, np.zeros((len(values), len(values))))
    sizes = {name: x.value for name, x in reported.items() if name not in effect.shape}
    names = scene.names(effect.joints)
    companions = tuple(Name(p.effect.kind, scene.names(p.effect.joints)) for p in found.companions)
    return Plant(
        (effect.kind,), names, (found.planted, *found.companions), frozenset(effect.runs),
        sizes=sizes, companions=companions,
    )  # fmt: skip


def beside(scene: Scene, plants: Sequence[Plant]) -> Scene:
    """The scene with these effects in the model, for what must be told apart from them."""
    columns = [weighted_columns(p.effect, scene.ground) for each in plants for p in each.effects]
    basis = np.linalg.qr(np.hstack([scene.model, *columns]))[0]
    return replace(scene, model=basis)


def separate(scene: Scene, plant: Plant) -> bool:
    """Whether the scene's model leaves a share of the plant's energy."""
    return all(
        left_over(scene.model, Sized(p, 0.0, 0, ()), scene.ground) >= _SEPARATE
        for p in plant.effects[:1]
    )


_PLAIN = ("coulomb_friction", "viscous_friction")


def _other_friction(scene: Scene, runs: frozenset[str], rng: np.random.Generator) -> Plant | None:
    j, which = int(rng.integers(scene.of.robot.n)), int(rng.uniform() < 0.35)
    change = float(rng.choice([-1.0, 1.0]) * rng.uniform(*_STRONGER))
    values = np.array([change * scene.friction[which, j]])
    effect = kind_named(_PLAIN[which])((j,), {}, tuple(sorted(runs)))
    if not shows(scene, [PlantedEffect(effect, values)]):
        return None
    return as_plant(scene, Sized(PlantedEffect(effect, values), 0.0, j, (j,)))


def _in_runs(kind: str, scene: Scene, rng: np.random.Generator) -> Plant | None:
    runs = (one_run if rng.uniform() < 0.5 else from_some_run)(scene, rng)
    everywhere = one_effect(
        kind_named(kind), scene.of, scene.ground, scene.model, (-1.0, np.inf), rng
    )
    if everywhere is None:
        return None
    effect: Effect = replace(everywhere.planted.effect, runs=tuple(sorted(runs)))
    found = replace(everywhere, planted=replace(everywhere.planted, effect=effect))
    return as_plant(scene, found) if shows(scene, [found.planted]) else None
