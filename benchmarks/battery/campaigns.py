"""Cases of the battery of campaigns: what was recorded, how, and what was in the robot.

A case follows from (seed, index) alone. Cases come in decks of sixteen, one of every group, that
the seed shuffles: 208 cases hold thirteen of each. From `FIRST_WITH_COLUMNS` on they are logs with
further columns, their groups in turn.
"""

from dataclasses import replace
from functools import cache, partial

import numpy as np

from benchmarks.battery import changes
from benchmarks.battery.cases import Case, first_made, model_columns
from benchmarks.battery.changes import Draw, Scene
from benchmarks.battery.columns import (
    drawn_series,
    friction_by_column,
    offset_by_column,
    pause_of,
    with_columns,
)
from benchmarks.battery.instruments import Instruments
from benchmarks.battery.motions import FRICTION, Arm
from benchmarks.battery.outside import MovedCenters
from benchmarks.battery.scoring import FIRST_ORDER, Plant
from benchmarks.battery.series import drawn_robot, robot_of, series, short_moves
from benchmarks.battery.sizes import ground_of
from excite_cli.config.spec import Spec
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.simulation.build import true_inertias
from excite_cli.simulation.ground_truth import PlantedEffect, sized
from excite_cli.simulation.settings import SimulationSettings

_CLEAN_DECK = ("clean_white", "clean_colored", "clean_centers")
CLEAN = (*_CLEAN_DECK, "clean_columns")
_CHANGES: dict[str, Draw] = {
    "payload": changes.payload,
    "payload_on_leaf": changes.payload_on_leaf,
    "friction_trend": changes.friction_trend,
    "friction_step": changes.friction_step,
    "friction_once": changes.friction_once,
    "offset_change": changes.offset_change,
    "gain_change": changes.gain_change,
    "contact": changes.contact,
    "unknown_map": changes.unknown_map,
}
GROUPS = (*_CHANGES, "short_moves", "stale_packets", "one_training_run", "several", *_CLEAN_DECK)
_BY_COLUMN: dict[str, Draw] = {
    "friction_by_column": friction_by_column,
    "offset_by_column": offset_by_column,
    "friction_trend_beside_columns": changes.friction_trend,
}
WITH_COLUMNS = (*_BY_COLUMN, "clean_columns")
FIRST_WITH_COLUMNS = 10_000

# What short moves, faulty packets and single training runs are asked about.
_SIMPLE = (
    "spring",
    "load_dependent_friction",
    "torque_offset",
    "armature",
    "cable_force",
    "asymmetric_friction",
    "nonlinear_viscous_friction",
    "ripple",
    "torque_gain",
)
_ALL_RUNS = (*_SIMPLE, "stribeck_friction", *FIRST_ORDER)
_IN_RUNS: tuple[Draw, ...] = (
    changes.payload,
    changes.offset_change,
    changes.friction_step,
    changes.gain_change,
)
_MOVED = (0.02, 0.035)  # m by which a centre of mass may be off


def group_of(seed: int, index: int) -> str:
    """The group of a case, without making it."""
    if index >= FIRST_WITH_COLUMNS:
        return WITH_COLUMNS[index % len(WITH_COLUMNS)]
    return _deck(seed, index // len(GROUPS))[index % len(GROUPS)]


@cache
def _deck(seed: int, number: int) -> tuple[str, ...]:
    order = np.random.default_rng([seed, 16, number]).permutation(len(GROUPS))
    return tuple(GROUPS[i] for i in order)


def make_case(seed: int, index: int) -> Case:
    """The case of a seed and an index."""
    group = group_of(seed, index)
    rng = np.random.default_rng([seed, 15, index])
    return first_made(lambda: _attempt(index, group, rng))


def _attempt(index: int, group: str, rng: np.random.Generator) -> Case | None:
    of = robot_of(drawn_robot(rng, group == "payload_on_leaf"))
    runs = _run_names(group, rng)
    held_out = runs[-1] if rng.uniform() < 0.6 else str(rng.choice(runs))
    motions = (short_moves if group == "short_moves" else series)(of, runs, rng)
    settings = _settings(group, rng)
    clock, instruments = _instruments(group, len(runs), settings.seed, rng)
    friction = _friction(group, rng)
    declared = declared_effects(FRICTION, of.robot) if friction != "none" else ()
    inside = sized(of.robot, declared, settings.seed)
    spec = of.spec.model_copy(update={"effects": FRICTION if friction == "declared" else ()})
    modelled = declared if friction == "declared" else ()
    phi = true_inertias(of.robot, settings.inertia_error, settings.seed)
    ground = ground_of(of.robot, phi, motions, inside, instruments.noise)
    if group in WITH_COLUMNS:
        columns = drawn_series(rng)
        ground = with_columns(ground, motions, columns)
        settings = replace(settings, covariates=columns, pause=pause_of(motions))
        names = tuple(str(name) for name in rng.permutation([each.name for each in columns]))
        measurement = spec.measurement.model_copy(update={"covariates": names})
        spec = spec.model_copy(update={"measurement": measurement})
    model = model_columns(of, declared, ground)
    scene = Scene(of, ground, model, runs, held_out, clock, _sizes(of, inside))
    changes = _plants(group, scene, friction, rng)
    if changes is None:
        return None
    background = () if modelled or not declared else _background(scene, inside)
    hidden = (_moved(of, rng),) if group == "clean_centers" else ()
    spec = _with_states(spec, changes, held_out, rng)
    return Case(
        index, group, of, motions, settings, spec, (*changes, *background), friction,
        instruments=instruments, hidden=hidden, held_out=held_out,
    )  # fmt: skip


def _run_names(group: str, rng: np.random.Generator) -> tuple[str, ...]:
    count = int(rng.integers(3, 9))
    if group == "one_training_run":
        count = 2
    elif group == "friction_trend" or group in WITH_COLUMNS:
        count = int(rng.integers(5, 9))
    return tuple(f"run_{k}" for k in range(1, count + 1))


def _settings(group: str, rng: np.random.Generator) -> SimulationSettings:
    rates = (500.0, 1000.0) if group == "stale_packets" else (200.0, 250.0, 500.0)
    return SimulationSettings(
        seed=int(rng.integers(2**31)),
        rate=float(rng.choice(rates[: 2 if rng.uniform() < 0.7 else None])),
        torque_noise=0.0,
        encoder=float(2 * np.pi / 2 ** rng.integers(17, 22)),
    )


def _instruments(
    group: str, runs: int, seed: int, rng: np.random.Generator
) -> tuple[tuple[float, ...], Instruments]:
    """The campaign's clock, zero at its start and one at its end, and what records it."""
    noise = float(np.exp(rng.uniform(np.log(0.005), np.log(0.02))))
    correlation = float(rng.uniform(0.5, 0.9)) if rng.uniform() < 0.4 else 0.0
    if group == "clean_white":
        correlation = 0.0
    elif group == "clean_colored":
        correlation = float(rng.uniform(0.5, 0.97))
    stamped = rng.uniform() < (0.5 if group == "friction_trend" else 0.3)
    clock = np.arange(runs, dtype=float)
    epochs: tuple[float, ...] = ()
    if stamped:
        clock = np.cumsum(rng.uniform(120.0, 1800.0, runs))
        clock -= clock[0]
        epochs = tuple(float(1.7e9 + x) for x in clock)
    faults = {"stale": 0.0, "dropped": 0.0}
    if group == "stale_packets":
        which = int(rng.integers(4))
        faults["stale"] = float(rng.uniform(0.01, 0.03)) if which != 3 else 0.0
        faults["dropped"] = float(rng.uniform(0.002, 0.01)) if which > 1 else 0.0
    made = Instruments(seed, noise, correlation, **faults, epochs=epochs)
    return tuple(clock / max(clock[-1], 1e-9)), made


def _friction(group: str, rng: np.random.Generator) -> str:
    if group.startswith("friction"):
        return str(rng.choice(["declared", "undeclared"], p=[0.7, 0.3]))
    if group in CLEAN:
        return str(rng.choice(["declared", "none"], p=[0.75, 0.25]))
    return str(rng.choice(["declared", "undeclared", "none"], p=[0.6, 0.2, 0.2]))


def _sizes(of: Arm, inside: tuple[PlantedEffect, ...]) -> np.ndarray:
    sizes = np.zeros((2, of.robot.n))
    for planted in inside:
        row = int(planted.effect.kind == "viscous_friction")
        sizes[row, list(planted.effect.joints)] += planted.values[0]
    return sizes


def _background(scene: Scene, inside: tuple[PlantedEffect, ...]) -> tuple[Plant, ...]:
    """Friction that every robot has and this config does not declare."""
    found = []
    for planted in inside:
        effect: Effect = planted.effect
        sizes = {effect.parameters[0].name: float(planted.values[0])}
        joints = scene.names(effect.joints)
        found.append(Plant((effect.kind,), joints, (planted,), sizes=sizes, required=False))
    return tuple(found)


def _plants(
    group: str, scene: Scene, friction: str, rng: np.random.Generator
) -> tuple[Plant, ...] | None:
    if group in CLEAN:
        return ()
    if group in _CHANGES or group in _BY_COLUMN:
        found = (_CHANGES | _BY_COLUMN)[group](scene, rng)
        return None if found is None else (found,)
    if group == "several":
        return _several(scene, friction, rng)
    if group == "short_moves" and rng.uniform() < 0.5:
        return ()
    pool: list[Draw] = [partial(changes.of_catalogue, kind) for kind in _ALL_RUNS]
    if group != "one_training_run":
        pool = [partial(changes.of_catalogue, kind) for kind in _SIMPLE] + [changes.payload] * 2
    found = pool[rng.integers(len(pool))](scene, rng)
    return None if found is None else (found,)


def _several(scene: Scene, friction: str, rng: np.random.Generator) -> tuple[Plant, ...] | None:
    """Two to four effects of different kinds that can be told apart."""
    in_runs = [draw for draw in _IN_RUNS if friction != "none" or draw != changes.friction_step]
    pool: list[Draw] = [partial(changes.of_catalogue, kind) for kind in _SIMPLE]
    pool += in_runs
    found: list[Plant] = []
    wanted = int(rng.integers(2, 5))
    for at in rng.permutation(len(pool)):
        around = changes.beside(scene, found)
        plant = pool[at](around, rng)
        kinds = {kind for each in found for kind in each.kinds}
        if plant is None or kinds & set(plant.kinds) or not changes.separate(around, plant):
            continue
        found.append(plant)
        if len(found) == wanted:
            return tuple(found)
    return None


def _moved(of: Arm, rng: np.random.Generator) -> PlantedEffect:
    """Every centre of mass about 3 cm from where the URDF has it."""
    away = rng.normal(size=(of.robot.n, 3))
    away *= rng.uniform(*_MOVED, (of.robot.n, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    return PlantedEffect(MovedCenters(tuple(range(of.robot.n))), away.ravel())


def _with_states(
    spec: Spec, plants: tuple[Plant, ...], held_out: str, rng: np.random.Generator
) -> Spec:
    """Half of the users whose held-out run is loaded say so, where a config can hold it."""
    says = rng.uniform() < 0.5
    loaded = [plant for plant in plants if plant.kinds == ("payload",) and held_out in plant.runs]
    if not (says and loaded and "runs" in Spec.model_fields):
        return spec
    states = {run: {"payload": "tool"} for plant in loaded for run in sorted(plant.runs)}
    return Spec.model_validate({**spec.model_dump(exclude_unset=True), "runs": states})
