"""Which effects are missing: a local search over sets of candidates.

J(S) = residual energy (whitened) + Σ price(c), see `judgement`. Steps: add a candidate, add two of
one joint at once (two effects may hide each other), replace one, drop one. Coherent effects compete
with local ones on all rows at once: one parameter that explains many joints wins over many that
explain one each.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

import numpy as np

from excite_cli.diagnosis.judgement import Judgement
from excite_cli.diagnosis.schur import Gain, Schur
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.effects.base import Place, Tier

_MOST_STEPS = 80
_TRIED = 12  # best candidates whose gain on runs left out is looked at in a step
# Of data too few to hold any name others come in its place, and more of them: 60 effects of 260
# candidates after 4 rounds of short moves, and a diagnosis of 17 minutes.
_GROWN = 1.5
_LOWER = 1e-6  # of J: less is rounding
_PAIRED = 14  # candidates of one joint that are tried in pairs

_Move = tuple[int, tuple[int, ...]]  # a member, and who comes in its place
T = TypeVar("T")


class CandidateSearch:
    """A search from the declared model for the set that is judged best."""

    def __init__(
        self,
        judge: Judgement,
        most: int = _MOST_STEPS,
        closed: Collection[Place] = (),
        over: Callable[[], bool] = lambda: False,
    ) -> None:
        """`most` effects at most, and none at the `closed` places; what is there when it is `over`
        is the answer."""
        self.judge, self._most, self._closed, self._over = judge, most, closed, over
        self.white, self.plain, self.candidates = judge.white, judge.plain, judge.candidates
        self._on_rows: dict[tuple[int, ...], list[int]] = {}
        self._places = [c.place for c in self.candidates]
        self._asked_for = [c.effect.asked_for for c in self.candidates]
        self._local = {  # of one column and one joint: tried in pairs
            i for i, c in enumerate(self.candidates) if len(c.rows) == 1 and c.width == 1
        }

    def run(self, start: Sequence[int] = ()) -> list[int]:
        """Search from the declared model, or from those of `start`, until no step lowers J.

        What does not hold in the end leaves its place to others, but not to itself.
        """
        closed, chosen = self._closed, self._settled(start)
        kept, most = self.pruned(chosen), _GROWN * len(chosen)
        while len(kept) < len(chosen) and not self._over():
            lost = {self.candidates[i].place for i in chosen if i not in kept}
            self._closed = {*self._closed, *lost}
            chosen = self._settled(kept)
            if len(chosen) > most or not self.judge.cost(chosen) < self.judge.cost(kept) - _LOWER:
                break
            kept = self.pruned(chosen)
        self._closed = closed
        return self._completed(kept)

    def _settled(self, start: Sequence[int]) -> list[int]:
        chosen = list(start)
        seen: list[list[int]] = [chosen]
        for _ in range(_MOST_STEPS):
            for latest in Tier:
                chosen = self._forward(chosen, latest)
            chosen = self._polish(chosen)
            again = next((k for k, old in enumerate(seen) if set(old) == set(chosen)), None)
            if again is not None:  # settled, or going round: what is taken back passes again
                return min(seen[again:], key=self.judge.cost)
            seen.append(chosen)
        return chosen

    def _completed(self, chosen: list[int]) -> list[int]:
        """With all that an effect refines on a joint, where some is in and it completes the rest.

        A small one may not pass on its own; without it the refinement would stand for it, and have
        a wrong size.
        """
        for i in chosen:
            effect = self.candidates[i].effect
            if not effect.completes:
                continue
            for joint in effect.joints:
                own = [p for p in self.judge.parents[i] if self.candidates[p].rows == (joint,)]
                open_ = [p for p in own if self.candidates[p].place not in self._closed]
                missing = [p for p in open_ if p not in chosen]
                more = [*chosen, *missing]
                if len(missing) == len(own) or not missing or len(more) > self._most:
                    continue
                if (
                    self.judge.allowed(self.plain.solve(more), more, missing)
                    or len(effect.joints) == 1
                ):
                    chosen = more
        return chosen

    def _forward(self, chosen: list[int], latest: Tier) -> list[int]:
        """Add candidates up to tier `latest` while one (or two of a joint) passes."""
        while len(chosen) < self._most and not self._over():
            added = self._best_one(chosen, latest) or self._best_two(chosen, latest)
            if not added or len(chosen) + len(added) > self._most:
                break
            chosen = [*chosen, *added]
        return chosen

    def _near(self, i: int) -> list[int]:
        """Candidates that show in some of a candidate's rows."""
        rows = self.candidates[i].rows
        if rows not in self._on_rows:
            own = set(rows)
            self._on_rows[rows] = [k for k, c in enumerate(self.candidates) if own & set(c.rows)]
        return self._on_rows[rows]

    def _free(
        self,
        chosen: Sequence[int],
        latest: Tier = Tier.LAST,
        among: Sequence[int] | None = None,
    ) -> list[int]:
        """Candidates up to tier `latest` whose place is free, and so is that of what excludes."""
        taken = {self.candidates[i].place for i in chosen}
        shut = {*self._closed, *(place for i in chosen for place in self.judge.excluded(i))}
        some = range(len(self.candidates)) if among is None else among
        return [
            i
            for i in some
            if self._places[i] not in taken
            and self._places[i] not in shut
            and self._asked_for[i] <= latest
        ]

    def _best_one(self, chosen: list[int], latest: Tier) -> tuple[int, ...]:
        """The candidate that saves most of those that pass."""
        schur = self.white.schur(chosen)
        free = [i for i in self._free(chosen, latest) if schur.singles[i].dof]
        refined = self.judge.refined_by(chosen)
        saved = {
            i: schur.singles[i].chi2 - self.judge.price_beside(i, refined, schur.singles[i].dof)
            for i in free
        }
        for i in sorted(free, key=lambda i: -saved[i])[:_TRIED]:
            if saved[i] <= 0:
                break
            if (
                self.judge.in_order(schur, chosen, [i])
                and self.judge.verdict(chosen, [i]) is Verdict.ACCEPTED
            ):
                return (i,)
        return ()

    def _best_two(self, chosen: list[int], latest: Tier) -> tuple[int, ...]:
        """Two of one joint at once, where none passes alone."""
        schur = self.white.schur(chosen)
        pairs = self._pairs(schur, schur.singles, self._free(chosen, latest))
        ranked = sorted(pairs, key=lambda found: -found[0])
        for saved, pair in ranked[:_TRIED]:
            if saved <= 0:
                break
            if (
                self.judge.in_order(schur, chosen, pair)
                and self.judge.verdict(chosen, pair) is Verdict.ACCEPTED
            ):
                return pair
        return ()

    def _pairs(
        self, schur: Schur, alone: Mapping[int, Gain], free: Sequence[int]
    ) -> list[tuple[float, tuple[int, int]]]:
        """What promising pairs of local candidates of one joint, of different kinds, save.

        `alone`: what each of them adds alone.
        """
        found = []
        local = [i for i in free if i in self._local]
        for rows in {self.candidates[i].rows for i in local}:
            own = [i for i in local if self.candidates[i].rows == rows and alone[i].dof]
            own.sort(key=lambda i: -alone[i].chi2)
            own = own[:_PAIRED]
            pairs = [
                (a, b) for k, a in enumerate(own) for b in own[k + 1 :] if self.judge.together(a, b)
            ]
            if not pairs:
                continue
            chi2s = schur.pair_chi2(*np.array(pairs).T)
            found += [
                (float(value) - self.judge.price(a, 1) - self.judge.price(b, 1), (a, b))
                for value, (a, b) in zip(chi2s, pairs, strict=True)
            ]
        return found

    def _polish(self, chosen: list[int]) -> list[int]:
        """Drop or replace (by one, or by two of the same joint) while J falls.

        The best of all moves is made, with the best of those that share no joint with it, and so
        on, where J falls more by all of them. Moves on joints where nothing has changed since are
        not looked for anew until nothing else lowers J.
        """
        known: dict[int, tuple[_Move, float]] = {}  # the best move of a member, and what it saves
        tried: set[int] = set()  # members whose moves are known, or that have none
        for _ in range(2 * len(chosen) + 4):
            fresh = not tried
            self.judge.expect(chosen)
            for i in chosen:
                if self._over():
                    return chosen
                if i not in tried:
                    tried.add(i)
                    move = self._best_move(i, chosen)
                    if move is not None:
                        known[i] = move
            before = self.judge.cost(chosen)
            then = self._moved(chosen, {move: -saved for move, saved in known.values()})
            if known and self.judge.cost(then) < before - _LOWER:
                changed = {j for i in {*chosen} ^ {*then} for j in self.candidates[i].rows}
                moves = {i: known[i][0] if i in known else (i, ()) for i in tried}
                tried = {i for i in tried if changed.isdisjoint(self._rows_of_move(moves[i]))}
                known = {i: each for i, each in known.items() if i in tried}
                chosen = then
            elif fresh:
                break
            else:  # elsewhere little has changed, and perhaps enough
                known, tried = {}, set()
        return chosen

    def _moved(self, chosen: list[int], moves: Mapping[_Move, float]) -> list[int]:
        """The set after the best move, or after those of all joints, whichever has the lower J."""
        if not moves:
            return chosen
        several = chosen
        for move in weakest_apart(moves, self._rows_of_move):
            several = _with_move(several, *move)
        one = _with_move(chosen, *min(moves, key=moves.__getitem__))
        return min(one, several, key=self.judge.cost) if len(several) <= self._most else one

    def _rows_of_move(self, move: _Move) -> set[int]:
        """Joints on which a member is, or who may come in its place."""
        member, instead = move
        return {j for i in (member, *instead) for j in self.candidates[i].rows}

    def _best_move(self, i: int, chosen: list[int]) -> tuple[_Move, float] | None:
        """The best move of a member that lowers J, and by how much."""
        if self.judge.bound(i, chosen):
            return None
        cost, instead = self._replaced(i, chosen)
        return None if instead is None else ((i, instead), self.judge.cost(chosen) - cost)

    def _replaced(self, i: int, chosen: list[int]) -> tuple[float, tuple[int, ...] | None]:
        """The lowest J of a set that differs in the member i, and who comes in its place."""
        best: float = self.judge.cost(chosen) - _LOWER
        found: tuple[int, ...] | None = None
        rest = [k for k in chosen if k != i]
        schur = self.white.schur(rest)
        energy = self.white.energy(rest)
        base = energy + self.judge.prices(rest)
        if base < best:
            best, found = base, ()
        alone = schur.singles_of(self._near(i))
        near = self._free(rest, among=self._near(i))
        moves: list[tuple[float, tuple[int, ...]]] = []
        gains: dict[tuple[int, ...], float] = {}
        for k in near:
            gain = alone[k]
            if k != i and gain.dof:
                moves.append((gain.chi2 - self.judge.price(k, gain.dof), (k,)))
                gains[(k,)] = gain.chi2
        for saved, pair in self._pairs(schur, alone, near):
            moves.append((saved, pair))
            gains[pair] = saved + self.judge.price(pair[0], 1) + self.judge.price(pair[1], 1)
        for saved, move in sorted(moves, key=lambda each: -each[0])[:_TRIED]:
            if base - saved >= best:
                break
            trial = [*rest, *move]
            if len(trial) > self._most:
                continue
            # parents are cheaper than `saved` says
            cost = energy - gains[move] + self.judge.prices(trial)
            if cost >= best:
                continue
            refined = len(move) == 1 and i in self.judge.parents[move[0]]
            if refined and not self.judge.adds(move[0], [*rest, i]):
                continue
            if (
                (refined and not self.candidates[move[0]].effect.imitates)
                or self.judge.in_order(schur, rest, move)
            ) and self.judge.allowed(self.plain.solve(trial), trial, move):
                best, found = cost, move
        return best, found

    def pruned(self, chosen: list[int]) -> list[int]:
        """Without those that, with all others in, are not significant or bring nothing.

        The weakest leaves first, of each joint at once: what it leaves to others is on that joint.
        """
        while True:
            failing = self.judge.failing(chosen)
            if not failing:
                return chosen
            gains = {i: self.white.gain_of(i, chosen).chi2 for i in failing}
            weakest = weakest_apart(gains, lambda i: self.candidates[i].rows)
            leaving = [self._in_its_way(i, gains[i], chosen) for i in weakest]
            chosen = [k for k in chosen if k not in leaving]

    def _in_its_way(self, i: int, gain: float, chosen: list[int]) -> int:
        """The weakest on its joints without which its size is possible; else the member itself.

        Beside friction of √v a TX40's friction of coupled gears exceeded the viscous friction that
        was left: it went, and J rose from 1771 to 5912.
        """
        if self.judge.allowed(self.plain.solve(chosen), chosen, [i]):
            return i
        own = set(self.candidates[i].rows)
        others = {
            k: self.white.gain_of(k, chosen).chi2
            for k in chosen
            if own & set(self.candidates[k].rows) and not self._carries(k, chosen)
        }
        for k in sorted(others, key=others.__getitem__):
            rest = [each for each in chosen if each != k]
            if others[k] < gain and self.judge.allowed(self.plain.solve(rest), rest, [i]):
                return k
        return i

    def _carries(self, k: int, chosen: Sequence[int]) -> bool:
        """Whether something chosen refines it."""
        return any(k in self.judge.parents[each] for each in chosen)


def _with_move(chosen: Sequence[int], member: int, instead: Sequence[int]) -> list[int]:
    """The set with others in a member's place."""
    return [*(k for k in chosen if k != member), *instead]


def weakest_apart(strength: Mapping[T, float], rows_of: Callable[[T], Collection[int]]) -> list[T]:
    """The weakest of some, with the weakest of those that share no joint with it, and so on."""
    found: list[T] = []
    taken: set[int] = set()
    for each in sorted(strength, key=strength.__getitem__):
        if taken.isdisjoint(rows_of(each)):
            found.append(each)
        taken.update(rows_of(each))
    return found
