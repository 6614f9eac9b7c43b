"""What every tool is given and what it answers, as files that need NumPy alone.

The drivers of other tools run in environments of their own and import this file from their folder.
A folder of a case holds `robot.urdf` and `given.npz`; a tool adds `NAME.npz`.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

BEGIN, END = "# --- what a user writes", "# --- until here"


@dataclass(frozen=True)
class Recording:
    """t (T,) [s]; q, dq, tau (T, n) as recorded; `used` (T,): samples that a fit may use.

    Of held-out parts of a recording the positions are there; in place of torques is a straight
    line.
    """

    t: np.ndarray
    q: np.ndarray
    dq: np.ndarray | None
    tau: np.ndarray
    used: np.ndarray

    @property
    def stretches(self) -> list[slice]:
        """Where samples in a row may be used."""
        edges = np.flatnonzero(np.diff(np.r_[0, self.used.astype(int), 0]))
        return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@dataclass(frozen=True)
class States:
    """q, v, a (T, n) at which torques are asked."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


@dataclass(frozen=True)
class Given:
    """`urdf` has the moved joints only, `joints` (n) in the order of all columns."""

    urdf: Path
    joints: tuple[str, ...]
    recordings: tuple[Recording, ...]
    asked: tuple[States, ...]


_OF_RECORDING, _OF_STATES = ("t", "q", "dq", "tau", "used"), ("q", "v", "a")


def write_given(folder: Path, urdf: str, given: Given) -> None:
    """Everything but the answers; `urdf` is the text of the file."""
    folder.mkdir(parents=True, exist_ok=True)
    given.urdf.write_text(urdf, encoding="utf-8")
    parts = {"joints": np.array(given.joints)}
    for kind, names in (("recordings", _OF_RECORDING), ("asked", _OF_STATES)):
        for k, each in enumerate(getattr(given, kind)):
            own = {f"{kind}_{k}_{name}": getattr(each, name) for name in names}
            parts |= {name: values for name, values in own.items() if values is not None}
    np.savez(folder / "given.npz", **parts)


def read_given(folder: Path) -> Given:
    """What `write_given` wrote."""
    stored = np.load(folder / "given.npz")

    def read(kind, names):
        count = sum(name.startswith(kind) and name.endswith("_q") for name in stored.files)
        return [[stored.get(f"{kind}_{k}_{name}") for name in names] for k in range(count)]

    recordings = tuple(Recording(*each) for each in read("recordings", _OF_RECORDING))
    asked = tuple(States(*each) for each in read("asked", _OF_STATES))
    return Given(folder / "robot.urdf", tuple(stored["joints"].tolist()), recordings, asked)


def write_answer(
    path: Path, torques: list[np.ndarray], phi: np.ndarray | None = None, told: str = ""
) -> None:
    """Torques (T, n) at the states that were asked; `phi` (bodies, 10) inertias as Pinocchio's."""
    extra = {} if phi is None else {"phi": phi}
    np.savez(path, told=told, **{f"tau_{k}": x for k, x in enumerate(torques)}, **extra)


def read_answer(path: Path) -> tuple[list[np.ndarray], np.ndarray | None, str]:
    """Torques, inertias where the tool has any, and what it told of itself."""
    stored = np.load(path)
    count = sum(name.startswith("tau_") for name in stored.files)
    return [stored[f"tau_{k}"] for k in range(count)], stored.get("phi"), str(stored["told"])


def lines_of_user(driver: Path) -> int:
    """Lines between the marks that are neither empty nor comments."""
    text = driver.read_text(encoding="utf-8")
    parts = [part.partition(END)[0] for part in text.split(BEGIN)[1:]]
    lines = [line.strip() for part in parts for line in part.splitlines()]
    return sum(bool(line) and not line.startswith("#") for line in lines)
