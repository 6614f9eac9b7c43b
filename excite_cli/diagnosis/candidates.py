"""What a diagnosis looks for: every kind of the catalogue, at every place, with every shape."""

import warnings
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.diagnosis.run_sets import MOST, evidence_by_run, run_sets, sets_looked_at
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import catalogue, is_of_a_package, kind_named
from excite_cli.effects.placing import places_named
from excite_cli.errors import ConfigError, ExciteWarning
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.processing import DEFAULT_MOVING
from excite_cli.robot.model import Array, Robot

_TOGETHER = 16  # effects that are filtered at once
_LOOKED_AT = 1000  # samples of a part, at most, from which the runs of an effect are told


# Kind, joints and runs: candidates that differ in shape only share it.
Place = tuple[str, tuple[int, ...], tuple[str, ...]]


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

    @property
    def place(self) -> Place:
        """Kind, joints and runs."""
        return self.effect.kind, self.effect.joints, self.effect.runs

    @property
    def width(self) -> int:
        """Number of linear parameters."""
        return len(self.effect.parameters)


def possible_effects(
    spec: DiagnosisSpec,
    robot: Robot,
    declared: Sequence[Effect],
    signals: Sequence[Signals],
    residuals: Sequence[Array],
    runs: Sequence[str],
    around: Mapping[Place, list[dict]],
) -> list[tuple[Effect, int]]:
    """All effects to be tested but those declared, and how many tests each stands for.

    `signals` and `residuals` (T, n) are of the training parts; `runs` the names of all runs, for
    effects that are present in some of them only; `around` shapes for (kind, joints, runs) that
    were found already.

    Raises
    ------
    ConfigError
        `diagnosis.kinds` or `exclude` names an unknown kind.
    """
    for name in (*([] if spec.kinds == "all" else spec.kinds), *spec.exclude):
        kind_named(name, "diagnosis")
    names = list(catalogue()) if spec.kinds == "all" else list(spec.kinds)
    known = {(e.kind, e.joints) for e in declared}
    found: list[tuple[Effect, int]] = []
    for name in names:
        if name in spec.exclude:
            continue
        kind = catalogue()[name]
        try:
            places = _places(kind, robot, spec)
            effects, tests = _of_kind(kind, places, robot, known, signals, residuals, runs)
            if is_of_a_package(kind):
                require_columns(effects, signals)
        except (Exception, SystemExit) as error:
            if not is_of_a_package(kind):
                raise
            words = f"effect '{name}' of a package is set aside: {type(error).__name__}: {error}"
            warnings.warn(words, ExciteWarning, stacklevel=2)
            continue
        count = max(tests, len(effects)) * len(names)
        for known_place, near in around.items():
            if known_place[0] == name:
                kept = [e for e in effects if (e.kind, e.joints, e.runs) != known_place]
                effects = kept + [kind(known_place[1], shape, known_place[2]) for shape in near]
        slowest = spec.moving_speed or DEFAULT_MOVING
        found += [
            (effect, count)
            for effect in effects
            # Below the speed at which a joint counts as moving, samples are left out.
            if effect.shows_above(slowest)
        ]
    if not found:
        raise ConfigError("diagnosis: every effect to be looked for is declared or excluded.")
    return found


def _places(kind: type[Effect], robot: Robot, spec: DiagnosisSpec) -> list[tuple[int, ...]]:
    if kind.carried and spec.carrying_links:
        return places_named(kind, spec.carrying_links, robot, "diagnosis.carrying_links")
    return kind.places(robot)


def _of_kind(
    kind: type[Effect],
    places: Sequence[tuple[int, ...]],
    robot: Robot,
    known: Container[tuple[str, tuple[int, ...]]],
    signals: Sequence[Signals],
    residuals: Sequence[Array],
    runs: Sequence[str],
) -> tuple[list[Effect], int]:
    """All effects of a kind at places that are not `known`, and how many tests they stand for."""
    effects: list[Effect] = []
    tests = 0
    for place in places:
        if (kind.kind, place) in known:
            continue
        if kind.per_run:
            effects += _in_runs(kind, robot, place, signals, residuals, runs)
            tests += sets_looked_at(len(runs)) * kind.tests_of_grid(robot, place, signals[:1])
        else:
            shapes = kind.tuned(robot, place, signals, residuals)
            effects += [kind(place, shape) for shape in shapes]
            tests += kind.tests_of_grid(robot, place, signals)
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


def _in_runs(
    kind: type[Effect],
    robot: Robot,
    place: tuple[int, ...],
    signals: Sequence[Signals],
    residuals: Sequence[Array],
    runs: Sequence[str],
) -> list[Effect]:
    """A kind that is present in some training runs only; in all it would be part of the robot."""
    trained = [run for run in runs if any(s.run.is_among((run,)) for s in signals)]
    unit_of = [next(k for k, u in enumerate(trained) if s.run.is_among((u,))) for s in signals]
    if kind.shapes:
        return _shaped_in_runs(kind, robot, place, (signals, residuals), (trained, unit_of))
    if len(trained) < 2:
        return []
    effect = kind(place, {})
    rows = list(effect.rows(robot.n))
    steps = [max(1, len(s.t) // _LOOKED_AT) for s in signals]
    found = evidence_by_run(
        [effect.columns(s.every(step)) for s, step in zip(signals, steps, strict=True)],
        [r[::step, rows] for r, step in zip(residuals, steps, strict=True)],
        unit_of,
        kind.parameters[0].nonnegative,
    )
    return [kind(place, {}, tuple(trained[k] for k in chosen)) for chosen in run_sets(found)]


def _shaped_in_runs(
    kind: type[Effect],
    robot: Robot,
    place: tuple[int, ...],
    motion: tuple[Sequence[Signals], Sequence[Array]],
    units: tuple[Sequence[str], Sequence[int]],
) -> list[Effect]:
    """The runs and shapes that explain most of the residual, a few of all."""
    found: list[tuple[float, Effect]] = []
    for number, run in enumerate(units[0]):
        own = [i for i, unit in enumerate(units[1]) if unit == number]
        signals, residuals = [motion[0][i] for i in own], [motion[1][i] for i in own]
        for shape in kind.tuned(robot, place, signals, residuals):
            effect = kind(place, shape, (run,))
            rows = list(effect.rows(robot.n))
            evidence = evidence_by_run(
                [effect.columns(s) for s in signals],
                [r[:, rows] for r in residuals],
                [0] * len(own),
                False,
            )
            found.append((evidence.energy([0]), effect))
    found.sort(key=lambda each: -each[0])
    return [effect for _, effect in found[:MOST]]


def with_columns(
    effects: Sequence[tuple[Effect, int]],
    signals: Sequence[Signals],
    runs: Sequence[PreparedRun],
) -> list[Candidate]:
    """Candidates with their filtered columns; those that are zero everywhere are left out."""
    n = signals[0].q.shape[1]
    alike: dict[tuple[int, ...], list[int]] = {}
    for i, (effect, _) in enumerate(effects):
        alike.setdefault(effect.rows(n), []).append(i)
    columns: list[list[Array]] = [[] for _ in effects]
    for signal, run in zip(signals, runs, strict=True):
        for rows, members in alike.items():
            blocks = _filtered([effects[i][0] for i in members], rows, signal, run)
            for i, block in zip(members, blocks, strict=True):
                columns[i].append(block)
        signal.body.forget()
    return [
        Candidate(effect, effect.rows(n), tuple(blocks), tests)
        for (effect, tests), blocks in zip(effects, columns, strict=True)
        if any(np.abs(block).max(initial=0.0) > 0 for block in blocks)
        and all(np.isfinite(block).all() for block in blocks)
    ]


def _filtered(
    effects: Sequence[Effect], rows: tuple[int, ...], signals: Signals, run: PreparedRun
) -> list[Array]:
    """Columns (M, len(rows), p) in one run of effects on the same rows, filtered together."""
    present = [i for i, effect in enumerate(effects) if effect.active(signals.run)]
    size = run.averages.shape[0], len(rows)
    found = [np.broadcast_to(0.0, (*size, len(effect.parameters))) for effect in effects]
    for some in _portions(present):
        columns = [effects[i].columns(signals) for i in some]
        ends = np.cumsum([block.shape[2] for block in columns])
        filtered = run.averaged_for_fit(np.concatenate(columns, axis=2), rows)
        for i, block in zip(some, np.split(filtered, ends[:-1], axis=2), strict=True):
            found[i] = block.copy()
    return found


def _portions(members: list[int]) -> list[list[int]]:
    """So few at once that their columns at the working rate take little memory."""
    return [members[at : at + _TOGETHER] for at in range(0, len(members), _TOGETHER)]


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
    )


def effect_of(record: EffectRecord, joint_names: Sequence[str]) -> Effect:
    """The effect that a record names."""
    joints = tuple(list(joint_names).index(joint) for joint in record.joints)
    shape: Mapping[str, float] = dict(record.shape)
    return catalogue()[record.kind](joints, shape, record.runs)
