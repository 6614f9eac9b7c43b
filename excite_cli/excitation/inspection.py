"""A second look at a finished motion: at instants of its own choice, between them, and by meshes.

Margins are taken at a rate and at random instants, as the optimiser computes them. The verdicts
come from enclosures that share nothing with that computation but the description of the robot, and
from the collision meshes by Pinocchio and coal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.errors import ConfigError
from excite_cli.excitation.admissible import CONTROLLER_RATE
from excite_cli.excitation.mesh_verdict import MeshVerdict, mesh_verdict
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.mesh_check import MeshCheck
from excite_cli.proof.certificate import Path, Verdict, certify
from excite_cli.proof.worst_margin import Worst
from excite_cli.shown.record import Shown

MESHES = "mesh_collision"
_OF_PAIRS = ("self_collision", "mesh_clearance", "surroundings")
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

    `worst`, `verdicts`: by constraint, in their order. `meshes`: None where self-collision is no
    constraint of the problem.
    """

    worst: dict[str, Worst]
    verdicts: tuple[Verdict, ...]
    meshes: MeshVerdict | None

    @property
    def violations(self) -> int:
        """Broken margins at the instants, and constraints broken only between them."""
        count = sum(worst.violations for worst in self.worst.values())
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
        """State and reason of each constraint."""
        found = {verdict.name: (str(verdict.state), verdict.reason) for verdict in self.verdicts}
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
    worst = _worst(problem, path, times)
    verdicts = _within_limits(certify(path, problem.constraints))
    if meshes is None:
        return Inspection(worst, verdicts, None)
    found = mesh_verdict(path, meshes, regular)
    if found.state == "sampled" and look.random:  # proof would have said more than any instants
        found = mesh_verdict(path, meshes, times)
    return Inspection(worst, verdicts, found)


def _within_limits(verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """Distances are not proved where positions leave the limits that pairs were chosen within."""
    if all(verdict.proved for verdict in verdicts if verdict.name == "joint_position"):
        return verdicts
    reason = "its pairs are those that can come near within the position limits"
    return tuple(
        replace(verdict, state="sampled", reason=reason)
        if verdict.proved and verdict.name in _OF_PAIRS
        else verdict
        for verdict in verdicts
    )


def instants_of(path: Path, look: Look) -> tuple[Array, Array]:
    """From start to end at the rate, both included; and these with the random instants."""
    duration = path.trajectory.duration
    regular = np.linspace(0.0, duration, int(np.ceil(duration * look.rate)) + 1)
    random = np.random.default_rng(look.seed).uniform(0.0, duration, look.random)
    return regular, np.sort(np.concatenate([regular, random]))


def _worst(problem: Problem, path: Path, times: Array) -> dict[str, Worst]:
    found: dict[str, Worst] = {}
    for begin in range(0, len(times), _CHUNK):
        some = times[begin : begin + _CHUNK]
        states = path.states_at(some)
        for constraint in problem.constraints:
            worst = constraint.worst(constraint.margins(states), some)
            before = found.get(constraint.name)
            found[constraint.name] = worst if before is None else before.with_later(worst)
    return found


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
