"""Which effects are missing: a local search over sets of candidates.

J(S) = residual energy (whitened) + Σ price(c). The price of a candidate is the χ² value that one of
all the tests made would exceed by chance in a share α of diagnoses (Bonferroni), plus a little for
unusual kinds: so a step downhill is a test with family-wise control. Steps: add a candidate, add
two of one joint at once (two effects may hide each other), replace one, drop one. An addition must
also lower the error on runs left out. Coherent effects compete with local ones on all rows at once:
one parameter that explains many joints wins over many that explain one each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import chi2

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import SHARED, Evidence, Gain, Schur
from excite_cli.robot.model import Array

# Surprise at an effect of this kind (χ² units), where two explain the data about as well.
UNUSUAL = {
    "viscous_friction": 0.0,
    "coulomb_friction": 0.0,
    "torque_offset": 1.0,
    "load_dependent_friction": 1.0,
    "armature": 1.0,
    "spring": 12.0,  # else a constant is called a preloaded spring as soon as noise bends it
    "coupled_friction": 3.0,
    "nonlinear_viscous_friction": 2.0,
    "asymmetric_friction": 4.0,
    "contact": 60.0,  # three forces in a window of one's choice explain any event a little
    "cable_force": 25.0,  # three smooth functions of two angles come near an offset or a spring
    "friction_drift": 15.0,  # within the seconds of a run, friction hardly warms up
    "stribeck_friction": 2.0,
}
_UNUSUAL_DEFAULT = 4.0
# The order in which kinds are asked for: what every robot has, what many have, the rest. A later
# kind may still replace an earlier one.
_FIRST_TIER = ("viscous_friction", "coulomb_friction")
LAST_TIER = (
    "ripple", "contact", "friction_drift", "cable_force", "elasticity", "backlash",
    "torque_saturation", "asymmetric_friction",
)  # fmt: skip
# First-order friction comes first: what refines it is only asked for once it is in.
FIRST = {
    "nonlinear_viscous_friction": ("viscous_friction", "coulomb_friction"),
    "stribeck_friction": ("viscous_friction", "coulomb_friction"),
    "friction_drift": ("viscous_friction", "coulomb_friction"),
    "coupled_friction": ("viscous_friction", "coulomb_friction"),
    "asymmetric_friction": ("coulomb_friction", "torque_offset"),
    "load_dependent_friction": ("coulomb_friction",),
}
# It stays in beside its refinement unless it is useless there (χ² units).
_PARENT_PRICE = 4.5
# Play is elasticity with a dead zone: of the two, one is named for a joint.
EXCLUDES = {"backlash": "elasticity", "elasticity": "backlash"}
COHERENT = ("base_tilt", "encoder_offset")
_FIRST_ORDER = 2e-3  # of their energy: what is left beside them may be their second order
_FAR_MORE = 0.15  # of the error on runs left out: more than noise makes of it
_TRANSFER = 0.06  # least share of the gain on fitted runs that runs left out must have
_SMALLEST = 2e-3  # of the torque's RMS: what is smaller needs no name
_MOST_STEPS = 80
_TRIED = 12  # best candidates whose gain on runs left out is looked at in a step
_PAIRED = 14  # candidates of one joint that are tried in pairs


@dataclass(frozen=True)
class Rules:
    """α of the family, least gain (RMS) on runs left out, inflation of χ²."""

    significance: float
    gain: float
    inflation: float = 1.0


@dataclass
class Search:
    """A search on whitened evidence; `plain` is the same data with independent samples.

    `allowed(chosen, added)` may veto a set, for instance for friction that would be negative.
    """

    white: Evidence
    plain: Evidence
    candidates: Sequence[Candidate]
    rules: Rules
    allowed: Callable[[Array, Sequence[int], Sequence[int]], bool]
    _thresholds: dict[tuple[int, int], float] = field(default_factory=dict)
    _most: int = _MOST_STEPS

    def __post_init__(self) -> None:
        """Look up who refines whom."""
        at = {(c.effect.kind, c.effect.joints): i for i, c in enumerate(self.candidates)}
        self.parents = [
            tuple(
                at[kind, (joint,)]
                for kind in FIRST.get(c.effect.kind, ())
                for joint in c.effect.joints
                if (kind, (joint,)) in at
            )
            for c in self.candidates
        ]

    def price(self, candidate: int, dof: int) -> float:
        """χ² that `candidate` must save."""
        c = self.candidates[candidate]
        unusual = UNUSUAL.get(c.effect.kind, _UNUSUAL_DEFAULT)
        key = (max(dof, 1), c.tests)
        if key not in self._thresholds:
            self._thresholds[key] = float(chi2.isf(self.rules.significance / c.tests, key[0]))
        return self.rules.inflation * self._thresholds[key] + unusual

    def _prices(self, chosen: Sequence[int]) -> float:
        """Price of a set: parents of members are cheap."""
        cheap = {p for i in chosen for p in self.parents[i]}
        return sum(
            self.rules.inflation * _PARENT_PRICE
            if i in cheap
            else self.price(i, self.candidates[i].width)
            for i in chosen
        )

    def _bound(self, candidate: int, chosen: Sequence[int]) -> bool:
        """Whether it must stay: √|v| beside no Coulomb and viscous friction is no physics."""
        return any(
            candidate in self.parents[k] and self.candidates[k].effect.shape.get("power") == 0.5
            for k in chosen
        )

    def cost(self, chosen: Sequence[int]) -> float:
        """J(S)."""
        return self.white.energy(chosen) + self._prices(chosen)

    def _in_order(self, schur: Schur, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether the first-order friction that `added` refines is in, or has nothing to add."""
        for i in added:
            for parent in self.parents[i]:
                if parent in chosen or parent in added:
                    continue
                gain = schur.singles[parent]
                if gain.chi2 > self.price(parent, gain.dof) and self.allowed(
                    self.plain.solve([*chosen, parent]), [*chosen, parent], [parent]
                ):
                    return False
        return True

    def without(self, member: int, chosen: Sequence[int]) -> list[int]:
        """The set without `member` and what refines it: first-order friction is judged alone."""
        return [k for k in chosen if k != member and member not in self.parents[k]]

    def p_value(self, candidate: int, gain: Gain) -> float:
        """Corrected for the number of tests and the inflation."""
        if gain.dof == 0:
            return 1.0
        single = chi2.sf(gain.chi2 / self.rules.inflation, gain.dof)
        return float(min(1.0, self.candidates[candidate].tests * single))

    def left_out_gain(self, chosen: Sequence[int], added: Sequence[int]) -> float:
        """Share by which the RMS error on runs left out falls, on the rows that `added` touches.

        The better of filtered torque and whitened torque: an effect near the noise shows in the
        second only. An effect of single runs is not there in others: it is judged where it is.
        """
        joints = sorted({j for i in added for j in self.white.rows_of[i]})
        best = -np.inf
        for evidence in (self.plain, self.white):
            if any(self.candidates[i].effect.runs for i in added):
                before = evidence.energy_on(chosen, joints)
                after = evidence.energy_on([*chosen, *added], joints)
            else:
                before = evidence.left_out(chosen, joints).sum()
                after = evidence.left_out([*chosen, *added], joints).sum()
            best = max(best, 1.0 - float(np.sqrt(after / max(before, 1e-300))))
        return best

    def size(self, chosen: Sequence[int], added: Sequence[int]) -> float:
        """What `added` explains, as a share of the torque's RMS on the joint where it is most."""
        largest = 0.0
        for joint in sorted({j for i in added for j in self.white.rows_of[i]}):
            before = self.plain.energy_on(chosen, [joint])
            after = self.plain.energy_on([*chosen, *added], [joint])
            whole = self.plain.torque_energy(joint)
            largest = max(largest, (before - after) / max(whole, 1e-300))
        return float(np.sqrt(largest))

    def _leftover(self, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether `added` is no more than the error of a coherent effect's linear form.

        Columns of a tilt or an encoder's zero are first order; what they leave of a large one
        looks like other effects on the same joints.
        """
        for joint in sorted({j for i in added for j in self.white.rows_of[i]}):
            coherent = [
                k
                for k in chosen
                if self.candidates[k].effect.kind in COHERENT and joint in self.white.rows_of[k]
            ]
            if not coherent:
                return False
            after = self.plain.energy_on([*chosen, *added], [joint])
            own = self.plain.energy_on(chosen, [joint]) - after
            theirs = max(
                self.plain.energy_on([c for c in [*chosen, *added] if c != k], [joint]) - after
                for k in coherent
            )
            if own > _FIRST_ORDER * theirs:
                return False
        return True

    def run(self, most: int = _MOST_STEPS) -> list[int]:
        """Search from the declared model until no step lowers J, or `most` effects are in."""
        chosen: list[int] = []
        self._most = most
        for _ in range(_MOST_STEPS):
            before = set(chosen)
            for tier in (1, 2, 3):
                chosen = self._forward(chosen, tier)
            chosen = self._polish(chosen)
            if set(chosen) == before:
                break
        return self._completed(self._pruned(chosen))

    def _completed(self, chosen: list[int]) -> list[int]:
        """With both straight friction terms of a joint, where one is in and either is refined.

        Small Coulomb friction may not pass on its own; without it √|v| or the friction of coupled
        gears would stand for it, and have wrong sizes.
        """
        for i in chosen:
            effect = self.candidates[i].effect
            if effect.shape.get("power") != 0.5 and effect.kind != "coupled_friction":
                continue
            for joint in effect.joints:
                own = [p for p in self.parents[i] if self.candidates[p].rows == (joint,)]
                missing = [p for p in own if p not in chosen]
                if len(missing) == len(own) or not missing:
                    continue
                more = [*chosen, *missing]
                if self.allowed(self.plain.solve(more), more, missing) or len(effect.joints) == 1:
                    chosen = more
        return chosen

    def tier(self, candidate: int) -> int:
        """When its kind is asked for."""
        kind = self.candidates[candidate].effect.kind
        return 1 if kind in _FIRST_TIER else 3 if kind in LAST_TIER else 2

    def _forward(self, chosen: list[int], tier: int) -> list[int]:
        """Add candidates up to `tier` while one (or two of a joint) passes."""
        while len(chosen) < self._most:
            added = self._best_one(chosen, tier) or self._best_two(chosen, tier)
            if not added:
                break
            chosen = [*chosen, *added]
        return chosen

    def _free(self, chosen: Sequence[int], tier: int = 3) -> list[int]:
        """Candidates up to `tier` whose place is not taken, nor that of what excludes them."""
        taken = {self.candidates[i].place for i in chosen}
        shut = {(EXCLUDES[kind], joints, runs) for kind, joints, runs in taken if kind in EXCLUDES}
        return [
            i
            for i, c in enumerate(self.candidates)
            if c.place not in taken and c.place not in shut and self.tier(i) <= tier
        ]

    def _best_one(self, chosen: list[int], tier: int) -> tuple[int, ...]:
        """The candidate that saves most of those that pass."""
        schur = self.white.schur(chosen)
        free = [i for i in self._free(chosen, tier) if schur.singles[i].dof]
        saved = {i: schur.singles[i].chi2 - self.price(i, schur.singles[i].dof) for i in free}
        best: int | None = None
        for i in sorted(free, key=lambda i: -saved[i])[:_TRIED]:
            if saved[i] <= 0:
                break
            if best is not None and not self._carries_more(chosen, i, best):
                continue
            if self._in_order(schur, chosen, [i]) and self.verdict(chosen, [i]) == "accepted":
                best = i
        return () if best is None else (best,)

    def _carries_more(self, chosen: Sequence[int], one: int, other: int) -> bool:
        """Whether `one` says far more than `other` about the same joints on runs left out."""
        if not set(self.white.rows_of[one]) & set(self.white.rows_of[other]):
            return False
        gains = [self.left_out_gain(chosen, [i]) for i in (one, other)]
        return gains[0] > gains[1] + _FAR_MORE

    def verdict(self, chosen: Sequence[int], added: Sequence[int]) -> str:
        """`accepted`, or why `added` may not join the chosen ones."""
        together = [*chosen, *added]
        if not self.allowed(self.plain.solve(together), together, added):
            return "impossible sign"
        if self.size(chosen, added) < _SMALLEST:
            return "too small to matter"
        if self._leftover(chosen, added):
            return "what a coherent effect leaves"
        if not self._generalises(chosen, added):
            return "no gain on runs left out"
        return "accepted"

    def _generalises(self, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether runs left out gain, and not far less than those fitted."""
        gain = self.left_out_gain(chosen, added)
        if gain < self.rules.gain:
            return False
        joints = sorted({j for i in added for j in self.white.rows_of[i]})
        fitted = max(
            1.0
            - np.sqrt(
                e.energy_on([*chosen, *added], joints) / max(e.energy_on(chosen, joints), 1e-300)
            )
            for e in (self.plain, self.white)
        )
        return bool(gain > _TRANSFER * fitted)

    def _best_two(self, chosen: list[int], tier: int) -> tuple[int, ...]:
        """Two of one joint at once, where none passes alone."""
        schur = self.white.schur(chosen)
        ranked = sorted(self._pairs(schur, self._free(chosen, tier)), key=lambda found: -found[0])
        for saved, pair in ranked[:_TRIED]:
            if saved <= 0:
                break
            if self._in_order(schur, chosen, pair) and self.verdict(chosen, pair) == "accepted":
                return pair
        return ()

    @staticmethod
    def _together(one: str, other: str) -> bool:
        """Whether two kinds may be named for one joint."""
        return one != other and EXCLUDES.get(one) != other

    def _pairs(self, schur: Schur, free: Sequence[int]) -> list[tuple[float, tuple[int, int]]]:
        """What promising pairs of local candidates of one joint, of different kinds, save."""
        found = []
        local = [
            i for i in free if len(self.candidates[i].rows) == 1 and self.candidates[i].width == 1
        ]
        for rows in {self.candidates[i].rows for i in local}:
            own = [i for i in local if self.candidates[i].rows == rows and schur.singles[i].dof]
            own.sort(key=lambda i: -schur.singles[i].chi2)
            own = own[:_PAIRED]
            pairs = [
                (a, b)
                for k, a in enumerate(own)
                for b in own[k + 1 :]
                if self._together(self.candidates[a].effect.kind, self.candidates[b].effect.kind)
            ]
            if not pairs:
                continue
            chi2s = schur.pair_chi2(*np.array(pairs).T)
            found += [
                (float(value) - self.price(a, 1) - self.price(b, 1), (a, b))
                for value, (a, b) in zip(chi2s, pairs, strict=True)
            ]
        return found

    def _polish(self, chosen: list[int]) -> list[int]:
        """Drop or replace (by one, or by two of the same joint) while J falls."""
        for _ in range(2 * len(chosen) + 4):
            better = self._best_replacement(chosen)
            if better is None:
                return chosen
            chosen = better
        return chosen

    def _loses(self, rest: Sequence[int], member: int, move: Sequence[int]) -> bool:
        """Whether runs left out would lose by the replacement what they gained by the member."""
        before = self.left_out_gain(rest, [member])
        return self.left_out_gain(rest, move) < before - _FAR_MORE

    def _root(self, candidate: int) -> bool:
        """√|v|, which comes near any friction and so replaces none."""
        return self.candidates[candidate].effect.shape.get("power") == 0.5

    def _best_replacement(self, chosen: list[int]) -> list[int] | None:
        """The set with the lowest J that differs in one member."""
        best, found = self.cost(chosen) - 1e-6, None
        for i in chosen:
            if self._bound(i, chosen):
                continue
            rest = [k for k in chosen if k != i]
            schur = self.white.schur(rest)
            base = self.cost(rest)
            if base < best:
                best, found = base, rest
            rows = set(self.candidates[i].rows)
            near = [k for k in self._free(rest) if rows & set(self.candidates[k].rows)]
            moves: list[tuple[float, tuple[int, ...]]] = []
            for k in near:
                gain = schur.singles[k]
                if k != i and gain.dof:
                    moves.append((gain.chi2 - self.price(k, gain.dof), (k,)))
            moves += self._pairs(schur, near)
            for saved, move in sorted(moves, key=lambda each: -each[0])[:_TRIED]:
                if base - saved >= best:
                    break
                trial = [*rest, *move]
                cost = self.cost(trial)  # parents are cheaper than `saved` says
                if cost < best and self._loses(rest, i, move):
                    continue
                refined = len(move) == 1 and i in self.parents[move[0]]
                if (
                    cost < best
                    and ((refined and not self._root(move[0])) or self._in_order(schur, rest, move))
                    and self.allowed(self.plain.solve(trial), trial, move)
                ):
                    best, found = cost, trial
        return found

    def _pruned(self, chosen: list[int]) -> list[int]:
        """Without those that, with all others in, are not significant or bring nothing."""
        while True:
            weakest: tuple[float, list[int]] | None = None
            for i in chosen:
                rest = [k for k in chosen if k != i]
                chi2_i = self.white.schur(rest).gain(i, absorbed=SHARED).chi2
                if self._fails(i, rest, chosen) and (weakest is None or chi2_i < weakest[0]):
                    weakest = (chi2_i, rest)
            if weakest is None:
                return chosen
            chosen = weakest[1]

    def _fails(self, i: int, rest: list[int], chosen: list[int]) -> bool:
        """Whether member i does not hold beside the rest."""
        if self._bound(i, chosen):
            return False
        right_sign = self.allowed(self.plain.solve(chosen), chosen, [i])
        if any(i in self.parents[k] for k in rest):
            return not right_sign
        gain = self.white.schur(rest).gain(i, absorbed=SHARED)
        return (
            self.p_value(i, gain) > self.rules.significance
            or not right_sign
            or self.left_out_gain(rest, [i]) < self.rules.gain
            or self.size(rest, [i]) < _SMALLEST
            or self._leftover(rest, [i])
        )
