"""Cases of the score board: a robot, its log, and what is held out; real ones first."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

DATA = Path(__file__).parents[2] / "data"


@dataclass(frozen=True)
class Case:
    """A config that declares no effect, its data, the run that is `held_out` (None: as excite
    does).

    `planted`: what a simulated robot has, by `benchmarks.robots.planting` (one record per effect).
    `coupled`: joints whose motors are coupled, as authors of another tool say in their example.
    """

    name: str
    words: str
    config: Path
    data: Path
    held_out: str | None = None
    planted: tuple[dict[str, Any], ...] = ()
    coupled: tuple[str, ...] = ()

    @property
    def is_real(self) -> bool:
        return not self.planted


REAL = (
    Case("tx40", "Stäubli TX40", DATA / "tx40" / "tx40.yaml", DATA / "tx40" / "tx40.h5",
         coupled=("joint_5", "joint_6")),
    Case("ur10", "UR10 (CB3)", DATA / "ur10_cb" / "ur10_cb.yaml",
         DATA / "ur10_cb" / "ur10_exciting_trajectory.db3"),
    Case("kr300", "KUKA KR300", DATA / "kr300" / "kr300.yaml", DATA / "kr300" / "kr300.h5", "C"),
    Case("tiago", "PAL TIAGo", DATA / "tiago" / "tiago.yaml", DATA / "tiago" / "tiago.h5"),
)  # fmt: skip
