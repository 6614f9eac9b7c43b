"""Measured motions: what every reader and the simulator yield, and identification takes.

Units: s, rad (m), rad/s, N·m (N) at the joint. What the file held is already converted by what the
configuration declares; nothing is dropped silently: `findings` says what was seen and done.
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from excite_cli.shown.record import Shown

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Severity = Literal["note", "warning", "error"]


@dataclass(frozen=True)
class Finding:
    """Something about the data that a person must know.

    `kind` is a short name (`gap`, `jitter`, `nan`, `saturated`, `dead`, `swapped`, `units`, `sign`,
    `truncated` …), `text` a sentence with what, where and what to do.
    """

    kind: str
    severity: Severity
    text: str
    run: str = ""
    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class Run:
    """One recording: t (T,), q and tau (T, n), dq (T, n) if it was recorded.

    `valid` (T, n): samples that may be used, per joint (false where saturated, stuck or bridged).
    `extra` holds further channels of the file, (T,) or (T, m), untouched.
    """

    name: str
    t: Array
    q: Array
    tau: Array
    dq: Array | None = None
    valid: NDArray[np.bool_] | None = None
    extra: dict[str, Array] = field(default_factory=dict)

    @property
    def step(self) -> float:
        """Mean sampling time [s]."""
        return float((self.t[-1] - self.t[0]) / (len(self.t) - 1))

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.t[-1] - self.t[0])

    def usable(self) -> NDArray[np.bool_]:
        """`valid`, or all true."""
        return np.ones(self.tau.shape, bool) if self.valid is None else self.valid

    def part(self, first: int, last: int, name: str) -> "Run":
        """Samples [first, last) as a run of its own."""
        cut = slice(first, last)
        return replace(
            self,
            name=name,
            t=self.t[cut],
            q=self.q[cut],
            tau=self.tau[cut],
            dq=None if self.dq is None else self.dq[cut],
            valid=None if self.valid is None else self.valid[cut],
            extra={key: value[cut] for key, value in self.extra.items()},
        )


@dataclass(frozen=True, repr=False)
class Dataset(Shown):
    """Runs of one robot; columns are in the order of `joint_names`."""

    joint_names: tuple[str, ...]
    runs: tuple[Run, ...]
    sources: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
