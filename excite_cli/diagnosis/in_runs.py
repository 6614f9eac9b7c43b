"""Effects of single runs that are tested: in declared sets of runs, else in sets that data tell.

What does not belong to the robot (something that it holds or touches) is in some runs and not in
the others. Of what all runs have (friction, the offset and the gain of a torque sensor) there may
be more or less in some: such a change is an effect of the same kind in runs of its own. In all
training runs either would be part of the model that they share; what was not trained on is in no
set that data tell.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from excite_cli.diagnosis.run_sets import (
    MOST,
    RunEvidence,
    evidence_by_run,
    run_sets,
    sets_looked_at,
)
from excite_cli.effects.base import Effect, Place, Signals
from excite_cli.effects.catalogue import shows
from excite_cli.identification.declared_states import States, declared_sets
from excite_cli.robot.model import Array, Robot
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

_CHANGES = 3  # sets of runs in which one joint's friction, offset or gain may have changed
_LOOKED_AT = 1000  # samples of a part, at most, from which the runs of an effect are told

Runs = tuple[str, ...]


@dataclass(frozen=True)
class SeenRuns:
    """Training parts, and what they leave: `signals` and `residuals` (T, n) of each.

    `left` (T, n): what the whole model found so far leaves, what is in some runs only included.
    `runs`: names of all runs, trained on or not; `states` those that the configuration declares;
    `measured`: whether sensors gave the torque.
    """

    robot: Robot
    signals: Sequence[Signals]
    residuals: Sequence[Array]
    runs: Sequence[str]
    states: States = field(default_factory=dict)
    measured: bool = True
    left: Sequence[Array] = ()

    def beside_found(self) -> "SeenRuns":
        """The same with what the whole model leaves: where else the like was, at another time."""
        return replace(self, residuals=self.left, left=())

    @cached_property
    def _by_name(self) -> dict[str, list[int]]:
        """Indices of parts by whatever their runs are called."""
        found: dict[str, list[int]] = {}
        for i, s in enumerate(self.signals):
            for name in {s.run.name, s.run.key}:
                found.setdefault(name, []).append(i)
        return found

    @property
    def trained(self) -> list[str]:
        """Names of the runs that parts belong to."""
        return [run for run in self.runs if run in self._by_name]

    @property
    def covariates(self) -> list[str]:
        """Columns of the log that are declared for effects to follow."""
        return list(self.signals[0].covariates)

    def parts_of(self, runs: Collection[str]) -> list[int]:
        """Indices of the parts of some runs."""
        return sorted({i for run in runs for i in self._by_name.get(run, ())})

    def only(self, run: str) -> "SeenRuns":
        """The parts of one run."""
        own = self.parts_of((run,))
        return SeenRuns(
            self.robot, [self.signals[i] for i in own], [self.residuals[i] for i in own], (run,)
        )

    def evidence(self, effect: Effect, units: Sequence[Runs], positive: bool) -> RunEvidence:
        """What columns of the effect say in each of the `units`."""
        rows = list(effect.rows(self.robot.n))
        parts = [(i, k) for k, runs in enumerate(units) for i in self.parts_of(runs)]
        thin = {i: max(1, len(self.signals[i].t) // _LOOKED_AT) for i, _ in parts}
        return evidence_by_run(
            [effect.columns(self.signals[i].every(thin[i])) for i, _ in parts],
            [self.residuals[i][:: thin[i], rows] for i, _ in parts],
            [k for _, k in parts],
            positive,
        )


def effects_of_runs(kind: type[Effect], place: tuple[int, ...], seen: SeenRuns) -> list[Effect]:
    """A kind that is present in some runs only."""
    sets = declared_sets(kind.kind, seen.states)
    if kind.shapes:
        named = None if sets is None else {run for runs in sets for run in runs}
        return _shaped(kind, place, seen, [r for r in seen.trained if named is None or r in named])
    if sets is None:
        sets = _told(kind(place, {}), seen, kind.parameters[0].nonnegative)
    return [kind(place, {}, runs) for runs in sets]


def changes(
    kind: type[Effect], known: Collection[Place], seen: SeenRuns
) -> list[tuple[Effect, int]]:
    """By how much there is more, or less, of a kind in some runs; how many tests each stands for.

    A change in some runs is the opposite change in all others, if all have the kind: so the fewer
    are named. What not every robot has may as well begin with the larger set, at a higher price.
    """
    if not kind.changes_between_runs or len(seen.trained) < 2:
        return []
    places = [at for at in kind.places(seen.robot) if shows(kind(at), seen.robot)]
    sets = declared_sets(kind.kind, seen.states)
    tests = len(places) * sets_looked_at(len(seen.trained))
    found: list[tuple[Effect, int]] = []
    for place in places:
        told = _told(kind(place, {}), seen, False, _CHANGES) if sets is None else sets
        for runs in told:
            rest = tuple(run for run in seen.trained if run not in runs)
            change = kind(place, {}, runs)
            found.append((change, tests))
            if sets is None and change.builds_on == kind.refines:
                found.append((kind(place, {}, rest), 2 * tests))
    whole = set(seen.trained)
    return [
        (effect, count)
        for effect, count in found
        if effect.place not in known and not whole <= set(effect.runs)
    ]


def _told(effect: Effect, seen: SeenRuns, positive: bool, most: int = MOST) -> list[Runs]:
    """The sets of runs that explain most."""
    trained = seen.trained
    if len(trained) < 2:
        return []
    found = seen.evidence(effect, [(run,) for run in trained], positive)
    return [tuple(trained[k] for k in chosen) for chosen in run_sets(found, most)]


def _shaped(
    kind: type[Effect], place: tuple[int, ...], seen: SeenRuns, runs: Sequence[str]
) -> list[Effect]:
    """The runs and shapes that explain most of the residual, a few of all."""
    found = [
        (energy, kind(place, shape, (run,)))
        for run, own in zip(runs, each(_of_run, (kind, place), map(seen.only, runs)), strict=True)
        for energy, shape in own
    ]
    found.sort(key=lambda pair: -pair[0])
    return [effect for _, effect in found[:MOST]]


def _of_run(
    about: tuple[type[Effect], tuple[int, ...]], seen: SeenRuns, tell: Tell
) -> list[tuple[float, dict]]:
    """Shapes in one run, with the energy that each explains there."""
    kind, place = about
    found = []
    for shape in kind.tuned(seen.robot, place, seen.signals, seen.residuals):
        effect = kind(place, shape, tuple(seen.runs))
        explained = seen.evidence(effect, [tuple(seen.runs)], False).energy(np.ones((1, 1), bool))
        found.append((float(explained[0]), shape))
    return found
