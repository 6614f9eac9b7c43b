"""What a diagnosis looks for: every kind of the catalogue, at every place, with every shape."""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis import rules
from excite_cli.diagnosis.in_runs import SeenRuns, changes, effects_of_runs
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.diagnosis.run_sets import sets_looked_at
from excite_cli.effects.base import Effect, Place, Signals
from excite_cli.effects.catalogue import EFFECTS, catalogue, kind_named, shows
from excite_cli.effects.placing import places_named
from excite_cli.errors import ConfigError
from excite_cli.identification.least_squares import EXACT
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.processing import DEFAULT_MOVING
from excite_cli.measurement.dataset import Mask
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array, Robot
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

_ROUNDING = 1e-11  # of the largest column of an effect, each with its usual size: no column
_TOGETHER = 16  # effects that are filtered at once: their columns take little memory


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing, with its columns in every training part.

    `columns[i]` (M_i, len(rows), p) filtered and decimated; zeros, which take no room, where it is
    not present.
    `tests`: how many tests its kind stands for, times the number of kinds (Bonferroni with equal
    shares of α for all kinds).
    """

    effect: Effect
    rows: tuple[int, ...]
    columns: tuple[Array, ...]
    tests: int = 1

    @cached_property
    def place(self) -> Place:
        """What candidates that differ in shape only share."""
        return self.effect.place

    @property
    def width(self) -> int:
        """Number of linear parameters."""
        return len(self.effect.parameters)


def possible_effects(
    spec: DiagnosisSpec,
    declared: Sequence[Effect],
    seen: SeenRuns,
    around: Mapping[Place, list[dict]],
) -> list[tuple[Effect, int]]:
    """All effects to be tested but those declared, and how many tests each stands for.

    `around` are shapes at places where effects were found already. Kinds that follow a column of
    the log are none where no column is declared, so that they cost the others nothing; nor are
    those of a wrench or of a torque sensor where there is none, nor, unless they are asked for by
    name, those that change with time in few recordings: seconds left out lie within the time of the
    others, and predict nothing of a recording that goes on for longer, or of the next one.

    Raises
    ------
    ConfigError
        `diagnosis.kinds` or `exclude` names an unknown kind.
    """
    for name in (*([] if spec.kinds == "all" else spec.kinds), *spec.exclude):
        kind_named(name, "diagnosis")
    names = list(catalogue()) if spec.kinds == "all" else list(spec.kinds)
    names = [name for name in names if _can_show(catalogue()[name], spec, seen)]
    kinds = {name: catalogue()[name] for name in names if name not in spec.exclude}
    known = {effect.place._replace(runs=()) for effect in declared}
    searched = _searched(kinds.values(), known, spec, seen)
    known_in_runs = {effect.place for effect in declared}
    found: list[tuple[Effect, int]] = []
    for name, kind in kinds.items():
        try:
            places = _places(kind, seen.robot, spec)
            effects, tests = _of_kind(kind, places, known, seen, searched)
            if kind.per_run and kind.shapes and any(at.kind == name for at in around):
                beside = seen.beside_found()
                effects += [e for at in places for e in effects_of_runs(kind, at, beside)]
            changed = changes(kind, known_in_runs, seen)
            if kind.kind in EFFECTS.foreign:
                require_columns([*effects, *(each for each, _ in changed)], seen.signals)
        except (Exception, SystemExit) as error:
            if kind.kind not in EFFECTS.foreign:
                raise
            EFFECTS.set_aside(f"effect '{name}'", f"{type(error).__name__}: {error}")
            continue
        count = max(tests, len(effects)) * len(names)
        for at, near in around.items():
            if at.kind == name:
                again = [kind(at.joints, shape, at.runs, at.covariate) for shape in near]
                if again[0].is_change:
                    changed = _with(changed, again[0])
                    continue
                effects = [effect for effect in effects if effect.place != at] + again
        slowest = spec.moving_speed or DEFAULT_MOVING
        found += [
            (effect, count)
            for effect in effects
            # Below the speed at which a joint counts as moving, samples are left out.
            if effect.shows_above(slowest)
        ]
        found += [(effect, tests * len(names)) for effect, tests in changed]
    if not found:
        raise ConfigError(
            "diagnosis: every effect to be looked for is declared or excluded, or follows a column "
            "of the log, of which measurement.covariates names none."
        )
    return found


def _can_show(kind: type[Effect], spec: DiagnosisSpec, seen: SeenRuns) -> bool:
    return (
        (bool(seen.covariates) or not kind.follows_covariate)
        and (bool(seen.robot.base_joints) or kind.scope != "base")
        and (seen.measured or not kind.of_sensor)
        and (
            spec.kinds != "all"
            or len(seen.trained) >= rules.RUNS_OF_A_DRIFT
            or "time" not in kind.function_of
        )
    )


def _with(changed: list[tuple[Effect, int]], found: Effect) -> list[tuple[Effect, int]]:
    """The changes, one that was found before among them."""
    there = any((e.joints, e.runs) == (found.joints, found.runs) for e, _ in changed)
    return changed if there else [*changed, (found, max((n for _, n in changed), default=1))]


def _places(kind: type[Effect], robot: Robot, spec: DiagnosisSpec) -> list[tuple[int, ...]]:
    if kind.carried and spec.carrying_links:
        return places_named(kind, spec.carrying_links, robot, "diagnosis.carrying_links")
    places = kind.places(robot)
    return [at for at in places if shows(kind(at), robot)] if robot.unmeasured else places


def _searched(
    kinds: Iterable[type[Effect]], known: Container[Place], spec: DiagnosisSpec, seen: SeenRuns
) -> dict[Place, list[dict]]:
    """Shapes of our own kinds that are searched in all runs, by place."""
    tasks = [
        place
        for kind in kinds
        if kind.is_searched() and not (kind.per_run or kind.follows_covariate)
        if kind.kind not in EFFECTS.foreign
        for joints in _places(kind, seen.robot, spec)
        if (place := Place(kind.kind, joints)) not in known
    ]
    shared = seen.robot, seen.signals, seen.residuals
    return dict(zip(tasks, each(_tuned, shared, tasks), strict=True))


def _tuned(
    shared: tuple[Robot, Sequence[Signals], Sequence[Array]], place: Place, tell: Tell
) -> list[dict]:
    robot, signals, residuals = shared
    return catalogue()[place.kind].tuned(robot, place.joints, signals, residuals)


def _of_kind(
    kind: type[Effect],
    places: Sequence[tuple[int, ...]],
    known: Container[Place],
    seen: SeenRuns,
    searched: Mapping[Place, list[dict]],
) -> tuple[list[Effect], int]:
    """All effects of a kind at places that are not `known`, and how many tests they stand for."""
    effects: list[Effect] = []
    tests = 0
    for place in places:
        if Place(kind.kind, place) in known:
            continue
        if kind.per_run:
            effects += effects_of_runs(kind, place, seen)
            tried = kind.tests_of_grid(seen.robot, place, seen.signals[:1])
            tests += sets_looked_at(len(seen.runs)) * tried
        elif kind.follows_covariate:
            for name in seen.covariates:
                if Place(kind.kind, place, covariate=name) not in known:
                    alone = [signals.with_covariate(name) for signals in seen.signals]
                    shapes = kind.tuned(seen.robot, place, alone, seen.residuals)
                    effects += [kind(place, shape, covariate=name) for shape in shapes]
                    tests += kind.tests_of_grid(seen.robot, place, alone)
        else:
            at = Place(kind.kind, place)
            if at in searched:
                shapes = searched[at]
            else:
                shapes = kind.tuned(seen.robot, place, seen.signals, seen.residuals)
            effects += [kind(place, shape) for shape in shapes]
            tests += kind.tests_of_grid(seen.robot, place, seen.signals)
    return effects, tests


def require_columns(effects: Sequence[Effect], signals: Sequence[Signals]) -> None:
    """Raise ValueError where columns are not finite, or not (T, rows, parameters)."""
    for effect in effects:
        for seen in signals:
            columns = np.asarray(effect.columns(seen))
            shape = (len(seen.t), len(effect.rows(seen.q.shape[1])), len(effect.parameters))
            if columns.shape != shape:
                raise ValueError(f"its columns have the shape {columns.shape} instead of {shape}")
            if columns.dtype.kind != "f" or not np.isfinite(columns).all():
                raise ValueError("its columns are not finite numbers")


def with_columns(
    effects: Sequence[tuple[Effect, int]],
    signals: Sequence[Signals],
    runs: Sequence[PreparedRun],
) -> list[Candidate]:
    """Candidates with their filtered columns; those that are zero everywhere are left out.

    So are those that are rounding (single columns become zero): a zero of the first axis, which
    gravity does not see, was given 1e11 rad of an upright robot, and with it the whole search hung
    on the processor.
    """
    n = signals[0].q.shape[1]
    alike: dict[tuple[int, ...], list[int]] = {}
    for i, (effect, _) in enumerate(effects):
        alike.setdefault(effect.rows(n), []).append(i)
    columns: list[list[Array]] = [[] for _ in effects]
    spool = Spool()
    sizes = [np.zeros(len(effect.parameters)) for effect, _ in effects]
    shared = [effect for effect, _ in effects], alike
    of_runs = each(_of_run, shared, zip(signals, runs, strict=True))
    for run, (blocks, largest) in zip(runs, of_runs, strict=True):
        sizes = [size + own for size, own in zip(sizes, largest, strict=True)]
        for (effect, _), own, block in zip(effects, columns, blocks, strict=True):
            if block is None:
                shape = run.averages.shape[0], len(effect.rows(n)), len(effect.parameters)
                block = np.broadcast_to(0.0, shape)
            own.append(spool.keep(block))
    dust = EXACT * max(float(np.abs(run.tau_fit).max(initial=0.0)) for run in runs)
    return [
        Candidate(
            effect,
            effect.rows(n),
            _without_dust(blocks, size > max(dust, _ROUNDING * size.max())),
            tests,
        )
        for (effect, tests), blocks, size in zip(effects, columns, sizes, strict=True)
        if dust < size.max() < np.inf
    ]


def _without_dust(blocks: Sequence[Array], shown: Mask) -> tuple[Array, ...]:
    """Columns of which no more than rounding `shown` (p,) are zero.

    A force along the axis of every joint was given 3e14 N of a planar arm.
    """
    return tuple(blocks if shown.all() else (np.where(shown, block, 0.0) for block in blocks))


def _of_run(
    shared: tuple[Sequence[Effect], dict[tuple[int, ...], list[int]]],
    task: tuple[Signals, PreparedRun],
    tell: Tell,
) -> tuple[list[Array | None], list[Array]]:
    """Columns of all effects in one run, None of those that are not in it; largest torques (p,).

    Effects on the same rows are filtered together: `alike` are their indices, by rows.
    """
    effects, alike = shared
    signals, run = task
    columns: list[Array | None] = [None for _ in effects]
    largest = [np.zeros(len(effect.parameters)) for effect in effects]
    for rows, members in alike.items():
        present = [i for i in members if effects[i].active(signals.run)]
        for start in range(0, len(present), _TOGETHER):
            some = present[start : start + _TOGETHER]
            blocks = [effects[i].columns(signals) for i in some]
            ends = np.cumsum([block.shape[2] for block in blocks])
            filtered = run.averaged_for_fit(np.concatenate(blocks, axis=2), rows)
            for i, block in zip(some, np.split(filtered, ends[:-1], axis=2), strict=True):
                columns[i] = block.copy()
                usual = [parameter.high for parameter in effects[i].parameters]
                largest[i] = np.abs(block * usual).max(axis=(0, 1), initial=0.0)
    signals.forget()
    return columns, largest


def shapes_around(effect: Effect, signals: Sequence[Signals]) -> list[dict]:
    """The effect's shape and neighbours of it, far and near, one parameter changed at a time.

    A grid names an effect, it does not measure it. Of a shape that is one of few (a power, a
    direction) all others: what was found first may have stood for something that is in by now.
    """
    found = [dict(effect.shape), *effect.shapes_near(signals)]
    if len(found) > 1:
        return found
    if effect.covariate:
        signals = [each.with_covariate(effect.covariate) for each in signals]
    grid = effect.grid(signals[0].body.robot, effect.joints, signals)
    return found + [shape for shape in grid if shape != found[0]]


def record_of(
    effect: Effect, joint_names: Sequence[str], values: Iterable[float] = ()
) -> EffectRecord:
    """The effect by name."""
    return EffectRecord(
        effect.kind,
        tuple(joint_names[j] for j in effect.joints),
        dict(effect.shape),
        tuple(float(value) for value in values),
        effect.runs,
        covariate=effect.covariate,
    )


def effect_of(record: EffectRecord, joint_names: Sequence[str]) -> Effect:
    """The effect that a record names."""
    joints = tuple(list(joint_names).index(joint) for joint in record.joints)
    shape: Mapping[str, float] = dict(record.shape)
    return catalogue()[record.kind](joints, shape, record.runs, record.covariate)
