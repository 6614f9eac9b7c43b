"""One judge for all: torques at the same filtered states, compared on the same samples.

The held-out part is filtered once, with cut-offs chosen from the training part alone. Every tool
answers torques at these states; its answers then go through the very averages that the measured
torque went through. Whether a joint moves, too, is decided by the states.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.exchange import Given, Recording, States
from excite_cli.api.loading import Case as Loaded
from excite_cli.api.loading import load_case, load_data
from excite_cli.dynamics.pseudo_inertia import pseudo_inertias
from excite_cli.identification.errors_of_torque import torque_errors
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.split import split, whole
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array


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


@dataclass(frozen=True)
class Verdict:
    """Relative errors (RMS/RMS) by joint where it moves, and the mean; NaN where it does not.

    `raw`: the same of the torque as recorded, over all samples, which no filter has touched.
    `possible`: whether every link's pseudo-inertia is positive definite; None without links.
    """

    mean: float
    by_joint: Mapping[str, float]
    raw: float
    possible: bool | None = None


@dataclass(frozen=True)
class Judge:
    """Parts that are held out, filtered, and the training recordings as they were recorded."""

    case: Loaded
    held_out: tuple[PreparedRun, ...]
    recordings: tuple[Recording, ...]

    def given(self, folder: Path) -> Given:
        """What every tool is given, in `folder`."""
        asked = tuple(States(run.q, run.v, run.a) for run in self.held_out)
        return Given(folder / "robot.urdf", self.case.robot.joint_names, self.recordings, asked)

    def verdict(self, torques: Sequence[Array], phi: Array | None = None) -> Verdict:
        """Of torques (T, n) at the states of every held-out part, and link inertias if any."""
        found = torque_errors(self.case.robot.joint_names, self.held_out, torques)
        possible = None if phi is None else physical(phi)
        raw = _raw(self.held_out, torques)
        return Verdict(found.mean_relative_moving, found.relative_moving, raw, possible)


def physical(phi: Array) -> bool:
    """Whether every body (bodies, 10) has a positive definite pseudo-inertia."""
    return bool(np.linalg.eigvalsh(pseudo_inertias(phi.ravel())).min() > 0.0)


def _raw(held_out: Sequence[PreparedRun], torques: Sequence[Array]) -> float:
    measured = np.concatenate([run.tau_raw for run in held_out])
    error, size = measured - np.concatenate(list(torques)), np.nansum(measured**2, axis=0)
    known = size > 0.0
    return float(np.mean(np.sqrt(np.nansum(error**2, axis=0)[known] / size[known])))


def judge_of(case: Case) -> Judge:
    """The judge of a case; raises what excite raises where config and data do not fit."""
    loaded = load_case(case.config)
    dataset = load_data(loaded, case.data, lambda note: None)
    spec = loaded.spec
    parts = split(dataset, case.held_out, spec.diagnosis.block)
    processing = choose_processing(
        parts.training, spec.measurement.filter, spec.diagnosis.moving_speed
    )
    recordings = [_recording(run, parts.training) for run in whole(dataset)]
    kept = tuple(each for each in recordings if each.used.any())
    return Judge(loaded, tuple(prepare_all(parts.held_out, processing)), kept)


def _recording(run: Run, training: Sequence[Run]) -> Recording:
    """Torques outside of the training part are not told; a straight line takes their place."""
    half = 0.5 * run.step
    mine = [part for part in training if part.id == run.id]
    inside = np.zeros(len(run.t), bool)
    for part in mine:
        inside |= (run.t > part.t[0] - half) & (run.t < part.t[-1] + half)
    known = inside[:, None] & run.usable() & np.isfinite(run.tau)
    tau = np.zeros(run.tau.shape)
    for j, good in enumerate(known.T):
        if good.any():
            tau[:, j] = np.interp(run.t, run.t[good], run.tau[good, j])
    return Recording(run.t, run.q, run.dq, tau, inside & known.all(axis=1))
