"""What was put into a campaign's robot, and what a diagnosis should call it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from excite_cli.simulation.ground_truth import Planted

# Effects whose columns are the first order of what they stand for.
FIRST_ORDER = ("base_tilt", "encoder_offset", "elasticity", "backlash", "torque_delay")
# Names of friction that changes over the campaign as a whole.
TRENDS = ("friction_change", "friction_drift", "friction_trend")


@dataclass(frozen=True)
class Plant:
    """One cause: the `effects` in the robot, and its name.

    `kinds` are the names it may go by, on `joints`. `runs`: those that have it; empty: all.
    `covariate`: the column of the log that it follows. `by_run`: how strong it is in each run,
    where that changes all the time. `sizes`: its parameters as a diagnosis reports them. What is
    not `required` is true, but nobody asks for it; what is not `nameable` is outside the catalogue.
    """

    kinds: tuple[str, ...]
    joints: tuple[str, ...]
    effects: tuple[Planted, ...]
    runs: frozenset[str] = frozenset()
    by_run: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    required: bool = True
    nameable: bool = True
    covariate: str = ""

    @property
    def in_words(self) -> str:
        """`payload@j6 in run_2+run_3`."""
        where = "+".join(self.joints) if len(self.joints) < 4 else "all"
        runs = f" in {'+'.join(sorted(self.runs))}" if self.runs else ""
        column = f" by {self.covariate}" if self.covariate else ""
        return f"{self.kinds[0]}@{where}{' over the runs' if self.by_run else runs}{column}"
