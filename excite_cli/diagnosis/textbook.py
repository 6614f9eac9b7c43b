"""The textbook's model: the everyday effects of `effects.catalogue` on every joint.

It is where the search begins, and what its answer must be better than. Everyday effects that
a robot does not have cost what they are fitted to; so of the four sets with and without them the
one is taken that predicts training data left out best (`comparison`).
"""

from collections.abc import Sequence
from itertools import product

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.comparison import ModelComparison
from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, catalogue, shows


def textbook_effects(model: DeclaredModel) -> list[Effect]:
    """The textbook's effects on all joints, those that are declared left away."""
    known = {effect.place for effect in model.declared}
    kinds = [catalogue()[name] for name in (*EVERYDAY_FRICTION, *EVERYDAY)]
    every = [kind(place) for kind in kinds for place in kind.places(model.robot)]
    return [each for each in every if each.place not in known and shows(each, model.robot)]


def everyday(candidates: Sequence[Candidate]) -> list[int]:
    """The textbook's effects among the candidates."""
    return _of(candidates, (*EVERYDAY_FRICTION, *EVERYDAY))


def textbook(candidates: Sequence[Candidate], models: ModelComparison) -> list[int]:
    """The candidates of that set of the textbook's which predicts data left out best."""
    best: list[int] | None = None
    for more in product((False, True), repeat=len(EVERYDAY)):
        kinds = [kind for kind, taken in zip(EVERYDAY, more, strict=True) if taken]
        chosen = _of(candidates, (*EVERYDAY_FRICTION, *kinds))
        if best is None or models.difference(best, chosen).better:
            best = chosen
    assert best is not None
    return best


def _of(candidates: Sequence[Candidate], kinds: Sequence[str]) -> list[int]:
    return [
        i
        for i, c in enumerate(candidates)
        if c.effect.kind in kinds and not (c.effect.runs or c.effect.is_change)
    ]
