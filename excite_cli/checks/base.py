"""What a check of `excite inspect` is: it looks at log and model, and says what is wrong."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from excite_cli.checks.check_result import CheckResult
    from excite_cli.config.spec import Spec
    from excite_cli.identification.prepare import PreparedRun
    from excite_cli.measurement.dataset import Run
    from excite_cli.robot.model import Robot


@dataclass(frozen=True)
class Log:
    """What a check looks at: `runs` as recorded, `prepared` ones (filtered), the config `spec`.

    Units are rad, rad/s, rad/s², N·m (m, N of slides), columns in the order of `robot.joint_names`.
    Without data there are no runs.
    """

    robot: Robot
    runs: Sequence[Run]
    prepared: Sequence[PreparedRun]
    spec: Spec


class Check(ABC):
    """One mistake: the `name` of its row, and its findings."""

    name: ClassVar[str]

    @abstractmethod
    def look(self, log: Log) -> Iterable[CheckResult]:
        """A doubt or a fault for all that is wrong; nothing where all is fine."""


class DescriptionCheck(Check):
    """One that looks at the robot alone, and also where there are no data."""
