"""Set points or torques of a log played on an exported model: does it move as the robot did?

Nothing holds the model. Its drives get what the robot's got,

    ctrl(t) = q*(t − d) + (k_d v*(t − d) + τ_ff(t − d)) / k_p,

with set points held from one sample to the next and d the delay of the command; or, where a log has
no set points, its joints get the measured torque. The model begins in the measured state (q, v) at
several starts, spread evenly over the log. Of its deviation e = q_model − q_measured there are,
joint by joint,

    e(H) = √(mean over starts of e²(t₀ + H))    for the horizons H,

and the RMS over the whole log, from its first sample on and without another start. Torques lead
any model away in a second or some, so of them there are |e(H)| at every start, and beside it what
two guesses without a model miss: the robot stands still, |q(t₀) − q(t₀ + H)|, or keeps its speed,
|q(t₀) + H v(t₀) − q(t₀ + H)|.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.simulation.mujoco_model import load_mujoco, silent_engine
from excite_cli.simulation.replay import ReplayInput

HORIZONS = (0.1, 1.0, 10.0)  # s
_MOST_STARTS, _MOST_SECONDS = 40, 200.0  # of each horizon
_LOST = np.pi  # rad (m): more is a model that fell over
_CHUNK = 20_000  # physics steps whose states are kept at a time
_STEP = 1e-3  # s, the longest
_ROUNDING = 1e-6  # s


@dataclass(frozen=True)
class SetPointInput:
    """A measured motion, and what the drives got meanwhile.

    `q, v` (T, m) at equidistant `t` (T,), of all joints of the model; `ctrl` (S, n) at `sent` (S,),
    one for each actuator, from before the first t on.
    """

    t: Array
    q: Array
    v: Array
    sent: Array
    ctrl: Array
    channel: ClassVar = "mjSTATE_CTRL"

    def acting(self, times: Array, step: float) -> Array:
        """The newest set points (K, n) at the beginnings `times` (K,) of physics steps."""
        sent = np.searchsorted(self.sent, times + _ROUNDING, side="right") - 1
        return self.ctrl[np.maximum(sent, 0)]


@dataclass(frozen=True)
class SetPointErrors:
    """`after` (H, m) RMS deviation [rad] (m) at each horizon (NaN where no log is so long).

    `starts` (H,): of how many; `whole` (m,): over the whole log. `lost`: it left all bounds.
    """

    after: Array
    starts: Indices
    whole: Array
    lost: bool


def set_point_errors(
    xml: str, runs: Sequence[SetPointInput], delay: float, horizons: Sequence[float] = HORIZONS
) -> SetPointErrors:
    """Errors of the model `xml` (MJCF, whose actuators have no delay of their own) on `runs`."""
    model = _compiled(xml)
    runs = [replace(run, sent=run.sent + delay) for run in runs]
    squares, counts = np.zeros((len(horizons), model.nv)), np.zeros(len(horizons), np.intp)
    total, samples, lost = np.zeros(model.nv), 0, False
    with silent_engine():
        for run in runs:
            player = _Player(model, run)
            deviation = player.deviation(0, len(run.t) - 1)
            lost |= bool((np.abs(deviation) >= _LOST).any())
            total += np.square(deviation).sum(axis=0)
            samples += len(deviation)
            for h, horizon in enumerate(horizons):
                for _, _, end in _ends(runs, player, horizon):
                    lost |= bool((np.abs(end) >= _LOST).any())
                    squares[h] += np.square(end)
                    counts[h] += 1
    with np.errstate(invalid="ignore"):
        after = np.sqrt(squares / np.where(counts > 0, counts, np.nan)[:, None])
    return SetPointErrors(after, counts, np.sqrt(total / max(samples, 1)), lost)


@dataclass(frozen=True)
class HorizonErrors:
    """|q_model − q_measured| (S, m) [rad] (m) `horizon` [s] after each of S starts, π at most.

    `still`, `steady` (S, m): the same of a robot that stands still, or keeps its speed.
    """

    horizon: float
    drift: Array
    still: Array
    steady: Array


def horizon_errors(
    xml: str, runs: Sequence[SetPointInput | ReplayInput], horizons: Sequence[float] = HORIZONS
) -> tuple[HorizonErrors, ...]:
    """Of the model `xml` (MJCF) on `runs`; without a horizon that no run is long enough for."""
    model, found = _compiled(xml), []
    with silent_engine():
        players = [_Player(model, run) for run in runs]
        for horizon in horizons:
            errors = []
            for player in players:
                run = player.run
                for first, last, end in _ends(runs, player, horizon):
                    moved = run.q[last] - run.q[first]
                    errors.append((end, moved, moved - horizon * run.v[first]))
            if errors:
                found.append(HorizonErrors(horizon, *np.abs(errors).transpose(1, 0, 2)))
    return tuple(found)


def _compiled(xml: str) -> Any:
    """The model without limits of joints; damping is taken implicitly."""
    mujoco = load_mujoco()
    model = mujoco.MjModel.from_xml_string(xml)
    disabled = mujoco.mjtDisableBit.mjDSBL_LIMIT, mujoco.mjtDisableBit.mjDSBL_AUTORESET
    model.opt.disableflags |= int(disabled[0] | disabled[1])
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.timestep = min(model.opt.timestep, _STEP)
    return model


def _ends(
    runs: Sequence[SetPointInput | ReplayInput], player: "_Player", horizon: float
) -> Iterator[tuple[int, int, Array]]:
    """Samples of start and end, and the deviation (m,) at the end, of every start of a run."""
    count = round(horizon / player.period)
    for first in _starts(runs, player.run, horizon, count):
        yield first, first + count, player.deviation(first, count)[-1]


def _starts(
    runs: Sequence[SetPointInput | ReplayInput],
    run: SetPointInput | ReplayInput,
    horizon: float,
    count: int,
) -> Indices:
    """Samples of `run` to begin at: its share of the starts of all runs."""
    room = len(run.t) - 1 - count
    if room < 0 or count < 1:
        return np.zeros(0, np.intp)
    most = max(1, min(_MOST_STARTS, int(_MOST_SECONDS / horizon)))
    lengths = [each.t[-1] - each.t[0] for each in runs]
    share = float((run.t[-1] - run.t[0]) / max(sum(lengths), 1e-9))
    own = min(max(1, round(most * share)), room + 1)
    return np.unique(np.linspace(0, room, own).round().astype(np.intp))


class _Player:
    """One run on a compiled model."""

    def __init__(self, model: Any, run: SetPointInput | ReplayInput) -> None:
        mujoco = load_mujoco()
        self.run, self.model = run, model
        self.period = float(run.t[-1] - run.t[0]) / (len(run.t) - 1)
        self.data = mujoco.MjData(model)
        self._kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self._step = float(model.opt.timestep)

    def deviation(self, first: int, count: int) -> Array:
        """q_model − q_measured (count, m) at the `count` samples after `first`, where it begins."""
        mujoco, run, model = load_mujoco(), self.run, self.model
        substeps = max(1, int(np.ceil(self.period / self._step - _ROUNDING)))
        told, model.opt.timestep = model.opt.timestep, self.period / substeps
        try:
            mujoco.mj_resetData(model, self.data)
            self.data.qpos[:], self.data.qvel[:] = run.q[first], run.v[first]
            state = np.empty(mujoco.mj_stateSize(model, self._kind))
            mujoco.mj_getState(model, self.data, state, self._kind)
            times = run.t[first] + np.arange(count * substeps) * model.opt.timestep
            acting = run.acting(times, model.opt.timestep)
            whole = _CHUNK // substeps * substeps or substeps
            found = []
            for start in range(0, len(acting), whole):
                states = self._played(state, acting[start : start + whole])
                found.append(states[substeps - 1 :: substeps, 1 : 1 + model.nq])
                state = states[-1]
        finally:
            model.opt.timestep = told
        deviation = np.concatenate(found) - run.q[first + 1 : first + 1 + count]
        return np.clip(np.nan_to_num(deviation, nan=_LOST), -_LOST, _LOST)

    def _played(self, state: Array, acting: Array) -> Array:
        """States (K, size) after each of the physics steps."""
        from mujoco import rollout

        channel = int(getattr(load_mujoco().mjtState, self.run.channel))
        states, _ = rollout.rollout(
            self.model, self.data, state[None], acting[None], control_spec=channel
        )
        return np.asarray(states[0])
