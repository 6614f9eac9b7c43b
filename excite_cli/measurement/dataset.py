"""Measured motions: what every reader and the simulator yield, and identification takes.

Units: s, rad (m), rad/s, N·m (N) at the joint. What the file held is already converted by what the
configuration declares; nothing is dropped silently: `findings` says what was seen and done.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from excite_cli.arrays import Array as Array
from excite_cli.arrays import Mask as Mask
from excite_cli.measurement.at_hand import columns_in, names_of, tables_of
from excite_cli.measurement.run_identity import Origin, Part, RunId
from excite_cli.out_of_core import Spool
from excite_cli.shown.answer import Shown

_BEFORE = 20.0  # s: longer ago is forgotten
Severity = Literal["note", "warning", "error"]
Given = Array | Sequence[Array]  # of one recording, or of each of several


class TorqueLaw(Protocol):
    """What the torques of a run are computed by, where nobody measured them."""

    def torque(self, run: "Run") -> Array:
        """τ (T, n) [N·m], 0 where it is not the law's."""

    def of_smooth(self, run: "Run", q: Array) -> "Run":
        """The run with the torque at smoothed positions q (T, n)."""

    def unsure(self, run: "Run") -> list[Array]:
        """Changes of τ (T, n) by one standard deviation of each figure that shifts it in time."""

    def by_gains(self, tau: Array) -> Array:
        """Changes (k, M, n) of averaged torques τ (M, n) by one of what scales them."""


@dataclass(frozen=True)
class Finding:
    """Something about the data that a person must know.

    `kind` is a short name (`gap`, `jitter`, `nan`, `saturated`, `dead`, `swapped`, `units`, `sign`,
    `truncated` …), `text` a sentence with what, where and what to do; `settings`: what to write in
    the config, by the path of the key, where that settles it.
    """

    kind: str
    severity: Severity
    text: str
    run: str = ""
    joints: tuple[str, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict, compare=False)


@dataclass(frozen=True, repr=False)
class Run(Shown):
    """One recording, or a part of it: t (T,), q and tau (T, n), dq (T, n) if it was recorded.

    `name` is the recording's, `part` says which part of it. `valid` (T, n): samples that may be
    used, per joint (false where saturated, stuck or bridged). `extra` holds further channels of the
    file, (T,) or (T, m), untouched; `covariates` (T,) are those that the configuration declares for
    effects to follow. `epoch`: seconds from 1970 (UTC) to t = 0, where the data know;
    `start`: the campaign's time at t = 0 [s], once it is known (`campaign_clock`). `recorded` (T,):
    where samples were interpolated, the hash of the nearest one in the file. `torque_step` (n,):
    what torques are multiples of, 0 where they are not. `before` (L, n): of a block, the positions
    right before it, from which joints with a memory come. The first `base_rows` columns are a
    base's, which has no friction: it counts at rest, too. Torques that follow from the motion by a
    `law` are taken anew where positions are smoothed.
    """

    name: str
    t: Array
    q: Array
    tau: Array
    dq: Array | None = None
    valid: NDArray[np.bool_] | None = None
    extra: dict[str, Array] = field(default_factory=dict)
    origin: Origin = field(default_factory=Origin)
    part: Part = field(default_factory=Part)
    epoch: float | None = None
    start: float = 0.0
    recorded: NDArray[np.uint64] | None = None
    covariates: dict[str, Array] = field(default_factory=dict)
    torque_step: Array | None = None
    before: Array | None = None
    base_rows: int = 0
    law: TorqueLaw | None = None

    @property
    def id(self) -> RunId:
        """The recording, and which stretch of it."""
        return RunId(self.name, self.part.stretch)

    @property
    def label(self) -> str:
        """For people: `b`, `b/2`, or `b 6-12 s` of a block."""
        if not self.part.block:
            return self.id.key
        return f"{self.id.key} {self.part.start:.4g}-{self.part.end or 0.0:.4g} s"

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

    def kept(self, spool: Spool) -> "Run":
        """The same run, its samples kept by the spool."""
        own: dict[str, Any] = {}
        for name in ("t", "q", "tau", "dq", "valid", "recorded"):
            values = getattr(self, name)
            own[name] = values if values is None else spool.keep(values)
        for name in ("extra", "covariates"):
            own[name] = {key: spool.keep(values) for key, values in getattr(self, name).items()}
        return replace(self, **own)

    def cut(self, first: int, last: int, part: Part | None = None) -> "Run":
        """Samples [first, last); they are another `part` of the recording if that is given."""
        cut = slice(first, last)
        wanted = round(_BEFORE / self.step)
        before = self.q[max(first - wanted, 0) : first]
        if self.before is not None and len(before) < wanted:
            before = np.concatenate([self.before, before])
        return replace(
            self,
            part=part or self.part,
            t=self.t[cut],
            q=self.q[cut],
            tau=self.tau[cut],
            dq=None if self.dq is None else self.dq[cut],
            valid=None if self.valid is None else self.valid[cut],
            extra={key: value[cut] for key, value in self.extra.items()},
            covariates={name: value[cut] for name, value in self.covariates.items()},
            recorded=None if self.recorded is None else self.recorded[cut],
            before=before[-wanted:],
        )


@dataclass(frozen=True, repr=False)
class Dataset(Shown):
    """Runs of one robot; columns are in the order of `joint_names`.

    Those `as_given` are in units of their own, with all their columns in `extra`: functions that
    have a config read these as they would those of a CSV. `load_data` does so alone.
    """

    joint_names: tuple[str, ...]
    runs: tuple[Run, ...]
    sources: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    as_given: bool = False

    @classmethod
    def from_arrays(
        cls,
        joint_names: Sequence[str],
        t: Given,
        q: Given,
        tau: Given | None = None,
        *,
        dq: Given | None = None,
        names: Sequence[str] = (),
        covariates: Mapping[str, Given] | None = None,
        extra: Mapping[str, Given] | None = None,
    ) -> Self:
        """Recordings at hand: t (T,), positions q, torques tau and speeds dq (T, n).

        Units and signs are those that the config's `measurement` declares (by default s, rad or m,
        N·m or N), and the checks of files are made of them. `covariates` (T,), such as a
        temperature, and `extra` channels, (T,) or (T, n) with a column per joint, are found by
        their names. Of several recordings all are lists of arrays; `names` are theirs.

        Raises
        ------
        ConfigError
            Shapes or lengths of lists differ, a name is there twice, or values are no numbers.
        """
        given = {**(covariates or {}), **(extra or {}), "t": t, "q": q, "tau": tau, "dq": dq}
        tables = tables_of(joint_names, given, covariates or ())
        return replace(cls.from_frame([*tables], names=names), joint_names=tuple(joint_names))

    @classmethod
    def from_frame(cls, frame: Any, *, names: Sequence[str] = ()) -> Self:
        """Recordings in tables with the columns of a CSV: `t`, `q_<joint>`, `tau_<joint>`, ….

        `frame` is a pandas DataFrame, or anything else that has its columns by name (polars, Arrow,
        a dict of arrays); of several recordings a list. Otherwise as `from_arrays`.

        Raises
        ------
        ConfigError
            It is no table, or columns have different lengths.
        """
        tables = [columns_in(x) for x in (frame if isinstance(frame, list | tuple) else [frame])]
        called = names_of(names, len(tables))
        own = (key for columns, _ in tables[:1] for key in columns if key.startswith("q_"))
        joints = tuple(key[2:] for key in own if not key.startswith("q_cmd_"))
        runs = (_as_given(name, joints, x) for name, (x, _) in zip(called, tables, strict=True))
        words = ", ".join(dict.fromkeys(word for _, left in tables for word in left))
        found = Finding("words", "note", f"columns of words are left out: {words}")
        return cls(joints, tuple(runs), (), (found,) if words else (), as_given=True)

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings, each once."""
        return tuple(dict.fromkeys(run.name for run in self.runs))

    @property
    def names(self) -> tuple[str, ...]:
        """What a configuration may call runs: recordings, then stretches of those with gaps."""
        return tuple(dict.fromkeys((*self.recordings, *(run.id.key for run in self.runs))))


def _as_given(name: str, joints: Sequence[str], columns: dict[str, Array]) -> Run:
    """NaN where there is no such column."""
    nothing = np.full(len(next(iter(columns.values()))), np.nan)
    q, tau = (
        np.array([columns.get(f"{channel}_{joint}", nothing) for joint in joints]).T
        for channel in ("q", "tau")
    )
    return Run(name, columns.get("t", nothing), q, tau, extra=columns)


# Findings of one kind as one sentence: the first as it is, of the others where they are.
#
# A fault of a recorder is found on many joints and in many runs. A record of each stays in the
# data; to a person it is told once.

_LISTED = 8  # places that are named


def merged(findings: Iterable[Finding]) -> list[Finding]:
    """One finding for all of the same kind and severity, in the order of the first of each.

    What is about no run and no joint stands for itself.
    """
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for found in findings:
        placed = bool(found.run or found.joints)
        key = (found.kind, found.severity, "" if placed else found.text)
        groups.setdefault(key, []).append(found)
    return [_one(group) for group in groups.values()]


def _one(group: Sequence[Finding]) -> Finding:
    first = group[0]
    same = [found for found in group if found.text == first.text]
    runs = dict.fromkeys(found.run for found in same if found.run)
    others: dict[str, dict[str, None]] = {}
    for found in group:
        if found.text != first.text:
            others.setdefault(", ".join(found.joints), {})[found.run] = None
    text = first.text
    if others:
        places = [_place(joints, list(runs)) for joints, runs in others.items()]
        more = f", and {len(places) - _LISTED} more" if len(places) > _LISTED else ""
        text = f"{text.removesuffix('.')}; likewise {'; '.join(places[:_LISTED])}{more}"
    joints = tuple(dict.fromkeys(joint for found in group for joint in found.joints))
    settings: dict[str, Any] = {}
    for found in group:
        settings = joined(settings, found.settings)
    return replace(first, text=text, run=", ".join(runs), joints=joints, settings=settings)


def joined(some: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of both: mappings and lists of names have what either has, else the later holds."""
    found = dict(some)
    for key, value in more.items():
        old = found.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            found[key] = {**old, **value}
        elif isinstance(old, list) and all(isinstance(each, str) for each in value):
            found[key] = list(dict.fromkeys([*old, *value]))
        else:
            found[key] = value
    return found


def _place(joints: str, runs: Sequence[str]) -> str:
    """`elbow (a, b)`, `elbow`, or `a, b`."""
    where = ", ".join(run for run in runs if run)
    if not joints:
        return where or "elsewhere"
    return f"{joints} ({where})" if where else joints


# A number for every sample of a run that only the very same positions and torques share.

_FACTOR = np.uint64(0xD6E8FEB86659FD93)
_SHIFT = np.uint64(32)


def row_hashes(run: Run) -> NDArray[np.uint64]:
    """Hashes (T,) of all digits of q and tau; time does not count."""
    found = np.zeros(len(run.t), np.uint64)
    for values in (run.q, run.tau):
        for column in np.asarray(values, dtype=float).T:
            bits = (column + 0.0).view(np.uint64)  # -0 and 0 are the same
            found = (found ^ bits) * _FACTOR
            found ^= found >> _SHIFT
    return found
