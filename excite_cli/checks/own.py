"""Checks of one's own: a package that declares, in the group `excite.checks`, a subclass of `Check`
adds a row to `excite inspect`, and what it finds wrong no identification or diagnosis takes.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

from excite_cli.checks.check_result import CheckResult
from excite_cli.config.spec import Spec
from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.dataset import Run
from excite_cli.packages import members
from excite_cli.robot.model import Robot

GROUP = "excite.checks"


@dataclass(frozen=True)
class Log:
    """What a check looks at: `runs` as recorded, `prepared` ones (filtered), the config `spec`.

    Units are rad, rad/s, rad/s², N·m (m, N of slides), columns in the order of `robot.joint_names`.
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


@cache
def own_checks() -> tuple[Check, ...]:
    """Those of all packages that are installed."""
    return tuple(check() for _, check in members(GROUP, Check, ("name",), "check"))  # type: ignore[type-abstract]
