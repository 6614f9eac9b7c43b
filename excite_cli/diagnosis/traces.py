"""What a diagnosis keeps of the data it saw, so that a report needs no data: frozen records."""

from dataclasses import dataclass
from typing import Annotated

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.fields import shape
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array


@dataclass(frozen=True)
class EffectTrace:
    """Training samples of one effect, on the joints where it shows most, the strongest first.

    `kind`, `joints`, `runs` and `covariate` are the effect's. `rows` names the joints of the
    columns; `part` (k,) numbers the stretches of time, `t` (k,) [s] from the start of their run.
    `x` (k, rows) [`unit`] is `quantity`, within one `period` if that is given; with no quantity,
    `x` is the effect's own torque. `own` and `partial` (k, rows) are C_e θ_e and p; NaN where a
    joint stands, reverses or is not known.
    """

    kind: str
    joints: tuple[str, ...]
    runs: tuple[str, ...]
    rows: Annotated[tuple[str, ...], shape("rows")]
    quantity: str
    unit: str
    period: float | None
    part: Annotated[Array, shape("k", finite=True)]
    t: Annotated[Array, shape("k", finite=True)]
    x: Annotated[Array, shape("k", "rows")]
    own: Annotated[Array, shape("k", "rows")]
    partial: Annotated[Array, shape("k", "rows")]
    covariate: str = ""


@dataclass(frozen=True)
class Dependence:
    """`shares` (n, K), 0 to 1: of the residual of each of `joints`, by each of `quantities`."""

    joints: Annotated[tuple[str, ...], shape("rows")]
    quantities: tuple[Covariate, ...]
    shares: Annotated[Array, shape("rows", "K")]


@dataclass(frozen=True)
class Traces:
    """What the training data show, kept so that a report needs no data.

    `torque_units` per joint; `runs` torque over time; `effects` in any order; `dependence` of what
    is left.
    """

    torque_units: Annotated[tuple[str, ...], shape("n")]
    runs: tuple[TorqueTrace, ...]
    effects: tuple[EffectTrace, ...]
    dependence: Dependence
