"""Records that travel from the optimiser to the file and the terminal."""

from dataclasses import dataclass, field, replace

from excite_cli.constraints.base import Array
from excite_cli.excitation.doubt import Doubt
from excite_cli.excitation.progress import Status
from excite_cli.proof.worst_margin import Worst
from excite_cli.shown.record import Shown


@dataclass(frozen=True)
class Outcome:
    """What a solver returns: the best admissible point it saw, as free variables x.

    With `last` (where it was when it stopped) and `memory` (its estimate of the curvature) it can
    go on. `way`: points that it came by, each with more room to the limits than the next.
    """

    x: Array
    status: Status
    iterations: int
    evaluations: int
    last: Array | None = None
    memory: Array | None = None
    way: tuple[Array, ...] = ()


@dataclass(frozen=True, repr=False)
class Motion(Shown):
    """One generated motion that keeps all constraints.

    `condition_number` is that of the motion alone, `stacked_condition_number` that of the motion
    with all earlier data, both on the samples of the cost, and `dense_condition_number` the latter
    on eight times as many (None in files of before). `improved` tells whether the stack became
    better by it; `note` says what else one should know; `certified` which constraints are proved
    at every instant. With a `doubt`, none counts as proved: the motion is another one than that
    which was. `digest` is that of all this (`motion_digest`), from when the motion was finished.
    """

    index: int
    coefficients: Array
    condition_number: float
    stacked_condition_number: float
    improved: bool
    status: Status
    seconds: float
    iterations: int
    evaluations: int
    margins: dict[str, Worst]
    note: str = ""
    certified: dict[str, bool] = field(default_factory=dict)
    dense_condition_number: float | None = None
    digest: str = ""
    doubt: Doubt = Doubt.NONE

    def doubted(self, doubt: Doubt) -> "Motion":
        """The motion of which nothing counts as proved, and why."""
        return replace(self, doubt=doubt, certified=dict.fromkeys(self.certified, False))
