"""Whether an effect may join a model: price, gain on runs left out, size, sign, order.

The price of a candidate is the χ² value that one of all the tests made would exceed by chance in a
share α of diagnoses (Bonferroni), plus a little for unusual kinds: so a step that lowers residual
energy + prices is a test with family-wise control. What joins must also lower the error on blocks
left out, be large enough to matter, and have a sign and a size that physics allows. Where it takes
scales to tell an effect from the inertias, these predict as well without it, and blocks left out
have no say.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.stats import chi2

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.schur import Gain, Schur
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.effects.base import Place
from excite_cli.robot.model import Array

_KEPT = 4096  # verdicts that are kept: a step of the search asks for the last one's again


Spot = tuple[str, tuple[int, ...], tuple[str, ...]]  # kind, joints, runs


@dataclass(frozen=True)
class Rules:
    """α of the family, least gain (RMS) on runs left out, inflation of χ², least p that is told."""

    significance: float
    gain: float
    inflation: float = 1.0
    least_p: float = 0.0


@dataclass
class Judgement:
    """Judges sets of candidates on whitened evidence; `plain` takes samples as independent.

    `allowed(parameters, chosen, added)` may veto a set, for instance for negative friction.
    `found`: candidates that are in the torque of the model at which columns were taken.
    """

    white: Evidence
    plain: Evidence
    candidates: Sequence[Candidate]
    rules: Rules
    allowed: Callable[[Array, Sequence[int], Sequence[int]], bool]
    found: Sequence[int] = ()
    _thresholds: dict[tuple[int, int], float] = field(default_factory=dict)
    _price: dict[tuple[int, int], float] = field(default_factory=dict, init=False)
    _verdicts: dict[tuple, Verdict] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Look up who refines whom, and which kinds exclude each other."""
        at = {
            (c.effect.kind, c.effect.joints): i
            for i, c in enumerate(self.candidates)
            if not c.effect.runs
        }
        self.parents = [
            tuple(
                at[kind, (joint,)]
                for kind in c.effect.builds_on
                for joint in c.effect.joints
                if (kind, (joint,)) in at
            )
            for c in self.candidates
        ]
        self._within = [self._in_columns(c) for c in self.candidates]
        kinds = {type(c.effect) for c in self.candidates}
        self._exclusive = {
            kind.kind: [other.kind for other in kinds if kind.exclusive_with(other)]
            for kind in kinds
        }
        self._places: dict[Spot, set[Place]] = {}
        for c in self.candidates:
            spot = (c.effect.kind, c.effect.joints, c.effect.runs)
            self._places.setdefault(spot, set()).add(c.place)

    def _in_columns(self, of: Candidate) -> tuple[int, ...]:
        """Candidates whose torque is in its columns: it would stand for them."""
        if not of.effect.of_whole_torque:
            return ()
        return tuple(
            i
            for i in self.found
            if not self.candidates[i].effect.data_defect
            and set(self.candidates[i].rows) & set(of.rows)
        )

    def excluded(self, candidate: int) -> list[Place]:
        """Places that must stay empty while it is in."""
        effect = self.candidates[candidate].effect
        return [
            place
            for kind in self._exclusive[effect.kind]
            for place in self._places.get((kind, effect.joints, effect.runs), ())
        ]

    def together(self, one: int, other: int) -> bool:
        """Whether both kinds may be named for one joint."""
        a, b = (self.candidates[i].effect for i in (one, other))
        return a.kind != b.kind and b.kind not in self._exclusive[a.kind]

    def price(self, candidate: int, dof: int) -> float:
        """χ² that `candidate` must save."""
        if (candidate, dof) not in self._price:
            self._price[candidate, dof] = self._price_of(candidate, dof)
        return self._price[candidate, dof]

    def _price_of(self, candidate: int, dof: int) -> float:
        c = self.candidates[candidate]
        key = (max(dof, 1), c.tests)
        if key not in self._thresholds:
            self._thresholds[key] = float(chi2.isf(self.rules.significance / c.tests, key[0]))
        prior_cost = c.effect.prior_cost + c.effect.shape_cost
        prior_cost += rules.ON_FEWER_ROWS * (candidate in self._on_fewer_rows)
        return self.rules.inflation * self._thresholds[key] + prior_cost

    @cached_property
    def _on_fewer_rows(self) -> set[int]:
        """Of candidates that scales alone tell from the declared model, those not on most rows."""
        schur = self.white.schur(())
        told = [i for i in range(len(self.candidates)) if schur.identified_by_prior_only(i)]
        most = max((len(self.candidates[i].rows) for i in told), default=0)
        return {i for i in told if len(self.candidates[i].rows) < most}

    def refined_by(self, chosen: Sequence[int]) -> set[int]:
        """First-order friction of which something chosen is a refinement."""
        return {parent for k in chosen for parent in self.parents[k]}

    def price_beside(self, candidate: int, refined: Collection[int], dof: int) -> float:
        """As `price`; first-order friction is cheap beside what refines it."""
        if candidate in refined:
            return self.rules.inflation * rules.PARENT_PRICE
        return self.price(candidate, dof)

    def prices(self, chosen: Sequence[int]) -> float:
        """Price of a set."""
        refined = self.refined_by(chosen)
        return sum(self.price_beside(i, refined, self.candidates[i].width) for i in chosen)

    def bound(self, candidate: int, chosen: Sequence[int]) -> bool:
        """Whether it must stay, since what refines it, or holds it, would take its place."""
        place = self.candidates[candidate].place
        return any(
            (candidate in self.parents[k] and self.candidates[k].effect.imitates)
            or any(self.candidates[i].place == place for i in self._within[k])
            for k in chosen
        )

    def expect(self, chosen: Sequence[int]) -> None:
        """Prepare for judging sets that lack one of the chosen."""
        self.white.schur(chosen)
        for blocks in (self.plain.in_turn, self.white.in_turn, self.plain.seen):
            blocks.fit(chosen)

    def cost(self, chosen: Sequence[int]) -> float:
        """J(S)."""
        return self.white.energy(chosen) + self.prices(chosen)

    def in_order(self, schur: Schur, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether what `added` refines, or has in its columns, is in, or would not be accepted."""
        there = {self.candidates[k].place for k in (*chosen, *added)}
        for i in added:
            for parent in (*self.parents[i], *self._within[i]):
                if self.candidates[parent].place in there:
                    continue
                gain = schur.gain(parent)
                if (
                    gain.chi2 > self.price(parent, gain.dof)
                    and self.verdict(chosen, [parent]) is Verdict.ACCEPTED
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
        """Share by which the RMS error of blocks left out falls, on the rows that `added` touches.

        The better of filtered torque and whitened torque: an effect near the noise shows in the
        second only.
        """
        joints = sorted({j for i in added for j in self.white.rows_of[i]})
        gains = []
        for e in (self.plain, self.white):
            before = e.in_turn.energies(chosen, joints)
            *others, last = added
            after = e.in_turn.with_each([*chosen, *others], [last], joints)[last]
            fitted = e.seen.with_each([*chosen, *others], [last], joints)[last]
            explained = float((e.seen.energies(chosen, joints) - fitted).sum())
            gains.append(self._gain(before, after, explained, added))
        return max(gains)

    def _gain(self, before: Array, after: Array, explained: float, added: Sequence[int]) -> float:
        """1 − the ratio of RMS errors; what single runs carry is judged where it is.

        Of what is too brief for any other block to know, with what a fit to all blocks explains.
        """
        if all(self.candidates[i].effect.runs for i in added):
            there = np.repeat(self.white.folds_of(added), 2)
            before, after = before[:, there], after[:, there]
        left = after.sum()
        if self.white.is_brief(added):
            left = max(before.sum() - explained, 0.0)
        return 1.0 - float(np.sqrt(left / max(before.sum(), 1e-300)))

    def size(self, chosen: Sequence[int], added: Sequence[int], joints: Sequence[int]) -> float:
        """What `added` explains, as a share of the torque's RMS on the joint where it is most."""
        *others, last = added
        before = self.plain.seen.energies(chosen, joints)
        after = self.plain.seen.with_each([*chosen, *others], [last], joints)[last]
        whole = [self.plain.grams.torque_energy(joint) for joint in joints]
        explained = np.maximum(before - after, 0.0)[:, 0] / np.maximum(whole, 1e-300)
        return float(np.sqrt(explained.max(initial=0.0)))

    def too_small(self, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether it may go without loss.

        Through the inertias that all joints share, what it explains may be on others than its own.
        """
        own = sorted({j for i in added for j in self.white.rows_of[i]})
        others = [j for j in range(len(self.plain.grams.joints)) if j not in own]
        return all(self.size(chosen, added, joints) < rules.SMALLEST for joints in (own, others))

    def identified_by_prior_only(self, candidate: int, others: Sequence[int]) -> bool:
        """Whether it is a gain that scales alone tell from the model with the others."""
        gain = self.candidates[candidate].effect.of_whole_torque
        return gain and self.white.schur(others).identified_by_prior_only(candidate)

    def _weighs_little(self, candidate: int, others: Sequence[int]) -> bool:
        """Whether all of its torque is too small to matter: what it explains, inertias explain."""
        (column,) = self.plain.blocks[candidate]
        own = self.plain.solve([*others, candidate])[-1] * self.plain.norms[column]
        rows = self.plain.rows_of[candidate]
        whole = sum(self.plain.grams.torque_energy(joint) for joint in rows)
        return bool(abs(own) < rules.SMALLEST * np.sqrt(whole))

    def verdict(self, chosen: Sequence[int], added: Sequence[int]) -> Verdict:
        """Accepted, or why `added` may not join the chosen ones."""
        key = tuple(sorted(chosen)), tuple(added)
        if key not in self._verdicts:
            if len(self._verdicts) == _KEPT:
                self._verdicts.clear()
            self._verdicts[key] = self._verdict(chosen, added)
        return self._verdicts[key]

    def _verdict(self, chosen: Sequence[int], added: Sequence[int]) -> Verdict:
        together = [*chosen, *added]
        if not self.allowed(self.plain.solve(together), together, added):
            return Verdict.IMPLAUSIBLE_SIZE
        if len(added) == 1 and self.identified_by_prior_only(added[0], chosen):
            little = self._weighs_little(added[0], chosen)
            return Verdict.TOO_SMALL if little else Verdict.ACCEPTED
        if self.too_small(chosen, added):
            return Verdict.TOO_SMALL
        if self.left_out_gain(chosen, added) < self.rules.gain:
            return Verdict.NO_GAIN
        return Verdict.ACCEPTED

    def adds(self, candidate: int, chosen: Sequence[int]) -> bool:
        """Whether it says more than what it refines, which is among the chosen.

        What has the columns of that and more must be worth its price for the more alone: friction
        that differs by direction replaced dry friction wherever there was the least of an offset.
        """
        gain = self.white.schur(chosen).gain(candidate)
        holds_it = gain.dof < self.candidates[candidate].width
        paid = not holds_it or gain.chi2 > self.price(candidate, gain.dof)
        return paid and not self.too_small(chosen, [candidate])

    def failing(self, chosen: Sequence[int]) -> list[int]:
        """Those that do not hold beside the others."""
        worth = self._worth_of_each(chosen)
        return [i for i in chosen if self._fails(i, chosen, *worth[i])]

    def _worth_of_each(self, chosen: Sequence[int]) -> dict[int, tuple[float, bool]]:
        """Gain of each beside the others on blocks left out, and whether it is large enough."""
        both = [
            (e.in_turn.without_each(chosen), e.in_turn.energies(chosen), *_seen(e, chosen))
            for e in (self.plain, self.white)
        ]
        whole = np.array([self.plain.grams.torque_energy(j) for j in range(len(both[0][1]))])
        found = {}
        for i in chosen:
            rows = list(self.white.rows_of[i])
            gain = max(
                self._gain(without[i][rows], now[rows], float((seen[i] - fitted)[rows].sum()), [i])
                for without, now, seen, fitted in both
            )
            _, _, seen, fitted = both[0]
            explained = np.maximum(seen[i] - fitted, 0.0)[:, 0] / np.maximum(whole, 1e-300)
            found[i] = gain, bool((np.sqrt(explained) >= rules.SMALLEST).any())
        return found

    def _fails(self, i: int, chosen: Sequence[int], gain: float, large: bool) -> bool:
        if self.bound(i, chosen):
            return False
        if not self.allowed(self.plain.solve(chosen), chosen, [i]):
            return True
        rest = [k for k in chosen if k != i]
        if any(i in self.parents[k] for k in rest):
            return False
        if self.p_value(i, self.white.gain_of(i, chosen)) > self.rules.significance:
            return True
        if self.identified_by_prior_only(i, rest):
            return self._weighs_little(i, rest)
        return gain < self.rules.gain or not large


def _seen(evidence: Evidence, chosen: Sequence[int]) -> tuple[dict[int, Array], Array]:
    """Energies (n, 1) that a fit to all rows leaves without each of the chosen, and with all."""
    return evidence.seen.without_each(chosen), evidence.seen.energies(chosen)
