"""A second look at a finished motion: at instants of its own choice, between them, and by meshes.

Margins are taken at a rate and at random instants, as the optimiser computes them; where there is
a second way to compute them, that is held against the first. The verdicts come from enclosures that
share nothing with that computation but the description of the robot, and from the collision meshes
by Pinocchio and coal.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from excite_cli.arrays import Mask
from excite_cli.config.spec import Spec
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.errors import ConfigError
from excite_cli.excitation.admissible import CONTROLLER_RATE
from excite_cli.excitation.motion import Doubt
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.mesh_check import MeshCheck, MeshGap, MeshGaps
from excite_cli.geometry.reasons import ContactMeaning
from excite_cli.proof.certificate import Path, ProofVerdict, State, Worst, certify
from excite_cli.proof.enclosed_motion import Intervals, enclosed_states, intervals_of
from excite_cli.robot.model import links_by_joint
from excite_cli.shown.answer import Shown

# Whether the true collision meshes stay apart between the instants, too.
#
# Enclosed positions say how far each joint may be from the middle of an interval. Meshes that are
# farther apart in the middle than their links can approach each other by that stay apart
# throughout; elsewhere the interval is cut in two.

_WIDTH = 0.02  # [s]
_CUTS = 10
_MOST_OPEN = 2000
_INTERVALS_AT_ONCE = 200


@dataclass(frozen=True)
class MeshVerdict:
    """What is known of the meshes along a motion; `times` (T,) are the instants of `gaps`."""

    state: State
    reason: str
    gaps: MeshGaps
    times: Array

    @property
    def proved(self) -> bool:
        """Whether no judged pair touches at any instant."""
        return self.state == "proved"

    def worst(self) -> Worst:
        """The nearest judged pair; a bound for all where none came near."""
        judged = [gap for gap in self.gaps.near if gap.standing is ContactMeaning.JUDGED]
        if not judged:
            return Worst(self.gaps.beyond, "m", "all pairs farther", float(self.times[0]), 0)
        nearest = judged[0]
        broken = sum(gap.touching for gap in judged)
        distance = -1e-9 if nearest.touching and nearest.distance >= 0 else nearest.distance
        words = f"{nearest.first} – {nearest.second}"
        return Worst(distance, "m", words, float(self.times[nearest.index]), broken, distance)

    @property
    def told(self) -> tuple[MeshGap, ...]:
        """Pairs that touch and are not judged, with the reason in `standing`."""
        return tuple(
            gap
            for gap in self.gaps.near
            if gap.standing is not ContactMeaning.JUDGED and gap.touching
        )


def mesh_verdict(path: Path, check: MeshCheck, times: Array) -> MeshVerdict:
    """Meshes at `times` (T,) [s], and between them."""
    gaps = check.least(path.states_at(times).q)
    if gaps.broken:
        return MeshVerdict("broken", "meshes touch", gaps, times)
    pending = intervals_of(path.trajectory, _WIDTH)
    asked = np.ones((len(pending), len(check.judged)), dtype=bool)
    for _ in range(_CUTS):
        pending, asked, broken = _open(path, check, pending, asked)
        if broken:
            return MeshVerdict("broken", "meshes touch between the instants", gaps, times)
        if not len(pending):
            return MeshVerdict("proved", "", gaps, times)
        if len(pending) > _MOST_OPEN:
            break
        pending, asked = pending.halved(), np.tile(asked, (2, 1))
    reason = "the meshes come too near to each other for a proof between the instants"
    return MeshVerdict("sampled", reason, gaps, times)


def _open(
    path: Path, check: MeshCheck, intervals: Intervals, asked: Mask
) -> tuple[Intervals, Mask, bool]:
    """Intervals with pairs that are not proved apart, which pairs, and whether any touch."""
    left, broken = np.zeros_like(asked), False
    for begin in range(0, len(intervals), _INTERVALS_AT_ONCE):
        some = slice(begin, begin + _INTERVALS_AT_ONCE)
        q = enclosed_states(path.trajectory, path.coefficients, intervals.only(some)).q
        proof = check.proved(q.center, change=q.reach, asked=asked[some])
        left[some] = asked[some] & ~proof.proved
        broken |= bool(proof.broken.any())
    again = np.asarray(left.any(axis=1))
    return intervals.only(again), left[again], broken


# Margins of a motion by a second computation, which shares nothing with the first.
#
# The second way (Pinocchio and coal for distances of capsules) takes an instant at a time, so it is
# asked at some instants only: evenly spread ones, and those where the first way finds the least.

TOLERANCE = 1e-6
"""By how much, in the unit of the margin, two computations may differ."""
_EVEN, _LOWEST = 250, 250


@dataclass(frozen=True)
class SecondPath:
    """What the second computation gave for one constraint: its worst margin, and how far it is off.

    instants: how many of all `of` instants were compared, in every column. difference: the largest,
    in `unit`, where and when [s] it is.
    """

    name: str
    worst: Worst
    instants: int
    of: int
    difference: float
    unit: str
    label: str
    time: float

    @property
    def agrees(self) -> bool:
        """Whether the two computations give the same."""
        return self.difference <= TOLERANCE


def second_paths(
    constraints: Sequence[Constraint], path: Path, times: Array, least: Sequence[Array]
) -> tuple[SecondPath, ...]:
    """For every constraint that has a second way.

    least: the smallest margins (T,) of each, as shares of their scales, by the first way.
    """
    found = (_compared(*each, path, times) for each in zip(constraints, least, strict=True))
    return tuple(each for each in found if each is not None)


def _compared(constraint: Constraint, least: Array, path: Path, times: Array) -> SecondPath | None:
    even = np.linspace(0, len(times) - 1, min(_EVEN, len(times))).astype(int)
    chosen = np.union1d(even, np.argsort(least, kind="stable")[:_LOWEST])
    states = path.states_at(times[chosen])
    second = constraint.independent_margins(states)
    if second is None:
        return None
    off = np.abs(second - constraint.margins(states))
    off[~np.isfinite(off)] = np.inf
    t, column = divmod(int(np.argmax(off)), off.shape[1])
    return SecondPath(
        name=constraint.name,
        worst=Worst.of(constraint, second, times[chosen]),
        instants=len(chosen),
        of=len(times),
        difference=float(off[t, column]),
        unit=constraint.unit_of(column),
        label=constraint.labels[column],
        time=float(times[chosen[t]]),
    )


MESHES = "mesh_collision"
_CHUNK = 2000
_MOST_RATE, _MOST_RANDOM = 1e6, 10_000_000


@dataclass(frozen=True)
class Look:
    """How closely to look: instants per second, random instants beside them, and their seed."""

    rate: float = CONTROLLER_RATE
    random: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise ConfigError for more instants than fit in memory."""
        if not 1.0 <= self.rate <= _MOST_RATE:
            raise ConfigError(
                f"rate: {self.rate:g} instants per second; allowed: 1 to {_MOST_RATE:g} Hz."
            )
        if not 0 <= self.random <= _MOST_RANDOM:
            raise ConfigError(f"random: {self.random:,} instants; allowed: 0 to {_MOST_RANDOM:,}.")


@dataclass(frozen=True, repr=False)
class Inspection(Shown):
    """What was seen of one motion.

    `worst`, `verdicts`: by constraint, in their order. `second`: of those constraints that can be
    computed in a second way. `meshes`: None where self-collision is no constraint of the problem.
    """

    worst: dict[str, Worst]
    verdicts: tuple[ProofVerdict, ...]
    second: tuple[SecondPath, ...]
    meshes: MeshVerdict | None

    @property
    def disagreeing(self) -> tuple[SecondPath, ...]:
        """Constraints of which two computations differ, so that neither can be trusted."""
        return tuple(each for each in self.second if not each.agrees)

    @property
    def violations(self) -> int:
        """Broken margins at the instants, constraints broken only between them, disagreements."""
        count = sum(worst.violations for worst in self.worst.values()) + len(self.disagreeing)
        for verdict in self.verdicts:
            if verdict.state == "broken" and not self.worst[verdict.name].violations:
                count += 1
        if self.meshes is not None and self.meshes.state == "broken":
            count += max(1, sum(gap.touching for gap in self.meshes.gaps.broken))
        return count

    @property
    def margins(self) -> dict[str, Worst]:
        """The worst margin by constraint, meshes included, wherever it was seen."""
        found = {}
        for verdict in self.verdicts:
            worst = self.worst[verdict.name]
            if verdict.state == "broken" and not worst.violations:
                worst = Worst(verdict.margin, worst.unit, verdict.label, verdict.time, 1)
            found[verdict.name] = worst
        if self.meshes is not None:
            found[MESHES] = self.meshes.worst()
        return found

    @property
    def certified(self) -> dict[str, bool]:
        """Whether each constraint is proved at every instant."""
        found = {verdict.name: verdict.proved for verdict in self.verdicts}
        if self.meshes is not None:
            found[MESHES] = self.meshes.proved
        return found

    @property
    def states(self) -> dict[str, tuple[str, str]]:
        """State and reason of each constraint; what no bound is known of is broken as seen."""
        found = {
            verdict.name: ("broken", "broken at the instants")
            if self.worst[verdict.name].violations and not verdict.bounded
            else (str(verdict.state), verdict.reason)
            for verdict in self.verdicts
        }
        if self.meshes is not None:
            found[MESHES] = (str(self.meshes.state), self.meshes.reason)
        return found


def mesh_check_of(problem: Problem) -> MeshCheck | None:
    """Meshes to be looked at; None without self-collision in the problem, or without meshes."""
    spec = problem.spec.constraints.self_collision
    if spec is None:
        return None
    by_hand = () if spec.capsules == "auto" else tuple(spec.capsules)
    check = MeshCheck(problem.robot, spec.ignore, by_hand)
    return check if check.pairs else None


def inspect(problem: Problem, path: Path, meshes: MeshCheck | None, look: Look) -> Inspection:
    """Margins, verdicts and meshes of one motion of the problem's robot."""
    regular, times = instants_of(path, look)
    worst, least = _worst(problem, path, times)
    second = second_paths(problem.constraints, path, times, least)
    for each in second:
        violations = max(worst[each.name].violations, each.worst.violations)
        worst[each.name] = replace(each.worst, violations=violations)
    verdicts = _within_limits(certify(path, problem.constraints), problem.constraints)
    if meshes is None:
        return Inspection(worst, verdicts, second, None)
    found = mesh_verdict(path, meshes, regular)
    if found.state == "sampled" and look.random:  # proof would have said more than any instants
        found = mesh_verdict(path, meshes, times)
    return Inspection(worst, verdicts, second, found)


def _within_limits(
    verdicts: tuple[ProofVerdict, ...], constraints: Sequence[Constraint]
) -> tuple[ProofVerdict, ...]:
    """Distances are not proved where positions leave the limits that pairs were chosen within."""
    both = list(zip(verdicts, constraints, strict=True))
    if all(verdict.proved for verdict, constraint in both if _of_positions(constraint)):
        return verdicts
    reason = "its pairs are those that can come near within the position limits"
    return tuple(
        replace(verdict, state="sampled", reason=reason)
        if verdict.proved and constraint.left_out is not None
        else verdict
        for verdict, constraint in both
    )


def _of_positions(constraint: Constraint) -> bool:
    columns = constraint.of_joints
    return columns is not None and columns.quantity == Quantity.POSITION


def instants_of(path: Path, look: Look) -> tuple[Array, Array]:
    """From start to end at the rate, both included; and these with the random instants."""
    duration = path.trajectory.duration
    regular = np.linspace(0.0, duration, int(np.ceil(duration * look.rate)) + 1)
    random = np.random.default_rng(look.seed).uniform(0.0, duration, look.random)
    return regular, np.sort(np.concatenate([regular, random]))


def _worst(problem: Problem, path: Path, times: Array) -> tuple[dict[str, Worst], list[Array]]:
    """The worst margin by constraint, and of each the smallest share of its scale (T,)."""
    found: dict[str, Worst] = {}
    least = [np.empty(len(times)) for _ in problem.constraints]
    for begin in range(0, len(times), _CHUNK):
        some = times[begin : begin + _CHUNK]
        states = path.states_at(some)
        for constraint, shares in zip(problem.constraints, least, strict=True):
            margins = constraint.margins(states)
            shares[begin : begin + _CHUNK] = (margins / constraint.scale).min(axis=1)
            worst = Worst.of(constraint, margins, some)
            before = found.get(constraint.name)
            found[constraint.name] = worst if before is None else before.with_later(worst)
    return found, least


def largest_mismatch(path: Path, times: Array, stored: Sequence[Array]) -> tuple[float, float]:
    """The largest difference of stored q, v, a (T, n) from the motion, and its instant [s].

    As a share of the largest value of each.
    """
    worst, when = 0.0, 0.0
    exact = path.trajectory.states(times, path.coefficients)
    for given, true in zip(stored, exact, strict=True):
        off = np.abs(given - true).max(axis=1) / max(float(np.abs(true).max()), 1.0)
        if off.max() > worst:
            worst, when = float(off.max()), float(times[int(np.argmax(off))])
    return worst, when


# What was seen of several motions, and how it was looked at.

# Stored samples may differ from the motion by rounding only.
_SAME = 1e-6


@dataclass(frozen=True)
class SampleDifference:
    """By how much samples that a file holds differ from its coefficients, and when [s].

    `share`: of the largest value.
    """

    share: float = 0.0
    time: float = 0.0

    @property
    def broken(self) -> bool:
        """Whether it is more than rounding: someone changed one of them."""
        return self.share > _SAME


@dataclass(frozen=True, repr=False, eq=False)
class Inspections(Shown, Mapping[str, Inspection]):
    """Inspections by the motion's name.

    `differences`: of the samples of motions from a result file. `doubts`: why motions of a result
    do not count as proved, whatever the result says of them. `slow`: the share of the limits of
    speed and acceleration that the motions were slowed to, if they were.
    """

    motions: dict[str, Inspection]
    look: Look
    differences: dict[str, SampleDifference] = field(default_factory=dict)
    slow: float | None = None
    doubts: dict[str, Doubt] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Inspection:
        return self.motions[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.motions)

    def __len__(self) -> int:
        return len(self.motions)

    def difference(self, name: str) -> SampleDifference:
        """That of one motion; none where no samples are known."""
        return self.differences.get(name, SampleDifference())

    def doubt(self, name: str) -> Doubt:
        """That of one motion; none where it is not of a result."""
        return self.doubts.get(name, Doubt.NONE)

    def violations_of(self, name: str) -> int:
        """Those of one motion, samples that differ included."""
        return self.motions[name].violations + self.difference(name).broken

    @property
    def violations(self) -> int:
        """Those of all motions."""
        return sum(map(self.violations_of, self.motions))


# What no constraint of a problem knows of: what a verdict on its motions does not speak of.

_LISTED = 4


def not_modelled(problem: Problem) -> tuple[str, ...]:
    """Things that a motion of `problem` may hit, by name, the most obvious first."""
    return not_in_config(
        problem.spec, [*links_without_shapes(problem), *bodies_without_shapes(problem)]
    )


def not_in_config(spec: Spec, bare: Sequence[str]) -> tuple[str, ...]:
    """The same of a config alone; `bare`: its links or joints that have no shapes."""
    asked, found = spec.constraints, []
    around = asked.surroundings
    if around is None:
        found.append("the floor and all else around the robot (constraints.surroundings)")
    elif around.floor is None and spec.robot.base == "fixed":
        found.append("the floor (constraints.surroundings.floor)")
    elif not around.boxes and not around.walls:
        found.append("all around the robot but the floor (constraints.surroundings)")
    if asked.self_collision is None:
        found.append("the robot's own links (constraints.self_collision)")
    if bare:
        more = f" and {len(bare) - _LISTED} more" if len(bare) > _LISTED else ""
        found.append(f"bodies without shapes: {', '.join(bare[:_LISTED])}{more}")
    return (*found, "cables, hoses and tools that are not in the URDF")


def links_without_shapes(problem: Problem) -> list[str]:
    """Links of `without_shapes` that have none indeed."""
    own, guarded = problem.spec.constraints.self_collision, _guarded(problem)
    if own is None or guarded is None:
        return []
    return [link for link in own.without_shapes if link not in guarded]


def bodies_without_shapes(problem: Problem) -> list[str]:
    """Moved joints whose bodies have mass and no shape, where self-collision is asked for."""
    guarded = _guarded(problem)
    if guarded is None:
        return []
    model, links = problem.robot.model, links_by_joint(problem.robot)
    return [
        joint
        for joint in problem.robot.tree.joint_names
        if model.inertias[model.getJointId(joint)].mass > 0 and not guarded & set(links[joint])
    ]


def _guarded(problem: Problem) -> set[str] | None:
    """Links that capsules keep apart; None where self-collision is not asked for."""
    capsules = [c.capsules for c in problem.constraints if isinstance(c, SelfCollision)]
    return {link for of in capsules for one in of for link in one.links} if capsules else None
