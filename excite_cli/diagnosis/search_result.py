"""What a search found, with all that it was judged by; models of any part of it are refitted."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.extrapolation import UsualMotion
from excite_cli.diagnosis.judgement import Judgement
from excite_cli.diagnosis.modelled_run import (
    DeclaredModel,
)
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.textbook import everyday
from excite_cli.diagnosis.training import TrainingData
from excite_cli.diagnosis.weighted_fit import WeightedFit
from excite_cli.effects.base import Effect, Signals
from excite_cli.robot.model import Array


@dataclass(frozen=True)
class SearchResult:
    """The outcome: training data, candidates, noise, the judgement, the chosen candidates.

    `plain`: candidates of the textbook's model, near which others are where data do not reach.
    """

    data: TrainingData
    candidates: tuple[Candidate, ...]
    noise: NoiseModel
    judge: Judgement
    chosen: tuple[int, ...]
    phi: Array
    signals: tuple[Signals, ...]
    levels: Array
    inflation: float
    sizes: PossibleSizes
    model: DeclaredModel
    usual: UsualMotion
    plain: tuple[int, ...] = ()

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that were found."""
        return tuple(self.candidates[i].effect for i in self.chosen)

    @property
    def members(self) -> list[int]:
        """What models may have: what was chosen, parts of it, and the textbook's effects."""
        parts = (k for i in self.chosen for k in self.parts_of(i))
        return sorted({*self.chosen, *everyday(self.candidates), *parts})

    def parts_of(self, i: int) -> list[int]:
        """Candidates in the place of one that are a part of it, with fewer parameters."""
        own = self.candidates[i]
        return [
            k
            for k, each in enumerate(self.candidates)
            if each.effect.kind in own.effect.same_as
            and each.place[1:] == own.place[1:]
            and each.width < own.width
        ]

    @cached_property
    def _least_squares(self) -> tuple[WeightedFit, dict[int, int]]:
        """Of what was chosen and of the textbook's effects, and where each of them is in it."""
        members = self.members
        own = [self.candidates[i] for i in members]
        at = {i: k for k, i in enumerate(members)}
        if not self.plain:
            return WeightedFit(self.data, own), at
        usual = self.usual.gram(self.model, [each.effect for each in own])
        return WeightedFit(self.data, own, usual, [at[i] for i in self.plain]), at

    def fitted(self, chosen: Sequence[int], held: Array | None = None) -> Array:
        """Parameters (k,) of the model with these of what was chosen, or the textbook's effects.

        Weighted least squares, as in `identify`; the first parameters are those that are `held`.
        """
        fit, at = self._least_squares
        return fit([at[i] for i in chosen], held)[0]

    def products(self) -> Array:
        """Products (k + 1, k + 1) that the fit of all that was chosen, in ascending order, solves.

        The torque's are the last.
        """
        fit, at = self._least_squares
        return fit.products([at[i] for i in sorted(self.chosen)])

    def imagined(self) -> tuple[Array, Array]:
        """Rows A (m, k) and b (m,) of unit variance, A x = b, beside the data of what was found."""
        fit, at = self._least_squares
        return fit.imagined([at[i] for i in self.chosen])
