"""What each effect takes off the error on sealed data, so that the parts of a joint add up.

Joining the model in one order, each effect takes off e(S) − e(S ∪ i), e the error of a joint where
it moves (`sealed_errors`); what it takes off depends on who came before. So its part is the mean
over many orders (Shapley 1953), drawn with a fixed seed, in which what an effect refines joins
before it. In every order the steps add up to e(∅) − e(all), and so do the parts.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from excite_cli.diagnosis.sealed_errors import SealedErrors
from excite_cli.diagnosis.tracing import Traced
from excite_cli.robot.model import Array

_SEED = 20251123
# Models that are fitted, about, and orders at most: of a Go2 with 54 effects 100 orders took a
# fifth of the time.
_MODELS, _ORDERS = 1500, 100


def error_parts(traced: Traced, errors: SealedErrors) -> dict[int, Array]:
    """Per who joins, what it takes off the relative error of each joint (n,) where it moves.

    `errors` of the sealed data. NaN for joints that hardly move there.
    """
    parts = {i: np.zeros(errors.joints) for i in errors.who}
    orders = list(_orders(traced, errors.who))
    for order in orders:
        before = errors.of(())
        for count, i in enumerate(order, start=1):
            then = errors.of(tuple(sorted(order[:count])))
            parts[i] += (before - then) / len(orders)
            before = then
    return parts


def _orders(traced: Traced, who: Sequence[int]) -> Iterator[list[int]]:
    """Orders in which what is refined comes first."""
    rng = np.random.default_rng(_SEED)
    parents = {i: set(traced.judge.parents[i]) if i >= 0 else set() for i in who}
    for _ in range(min(_MODELS // len(who), _ORDERS) if len(who) > 1 else 1):
        order: list[int] = []
        waiting = [int(i) for i in rng.permutation(who)]
        while waiting:
            # Kinds may refine each other: then the first comes first.
            ready = next((i for i in waiting if not parents[i] & set(waiting)), waiting[0])
            waiting.remove(ready)
            order.append(ready)
        yield order
