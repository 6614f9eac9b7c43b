"""The error of a model on a motion before it is played: `excite score --job`."""

from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case
from excite_cli.api.model import Model, load_model
from excite_cli.api.motions import Motions, load_motions
from excite_cli.identification.regression import Series
from excite_cli.identification.torque_trace import torque_units
from excite_cli.scoring.forecast import Forecast, joint_forecasts
from excite_cli.scoring.validity import States, Trust, states_of
from excite_cli.shown.note import Tell, log_note
from excite_cli.summary.forecast import forecast_answer as forecast_answer
from excite_cli.trajectory.fade import Segment

_RATE = 100.0  # Hz
_MOST = 200_000  # states: longer jobs are sampled more coarsely


@checked()
def forecast(model: Model | str | Path, job: Motions, *, tell: Tell = log_note) -> Forecast:
    """The error to expect of a model on a motion that nobody measured yet: `excite score --job`.

    `job` is what `load_motions` takes: a plan in a controller's format (CSV, ROS 2, MoveIt …), a
    result, or a log, whose motion is taken. Expected is the standard deviation of `Model.torque(…,
    std=True)` along it, as RMS where the joints move.

    Raises
    ------
    FileError, ConfigError, RobotError
        See `Model.load` and `load_data`; the model does not say what it left of its own data; it
        follows a column of the log, which a plan has not.
    """
    given = model if isinstance(model, Model) else load_model(model)
    stored = given.made
    trust, model_of_all_runs = Trust(stored), stored.model.without(given.left_out)
    case = Case(stored.spec, stored.folder, stored.robot)
    motions = load_motions(case, job, tell=tell)
    seconds = sum(each.trajectory.duration for each in motions)
    parts = []
    for each in motions:
        series = _series(each, min(_RATE, _MOST / seconds))
        given.torque(series.q[:2], series.v[:2], series.a[:2], series.t[:2])  # it can be asked
        found = model_of_all_runs.predicted(stored.robot, series)
        parts.append((*vars(states_of(series, found)).values(), trust.deviation(series, found)))
    *states, deviation = (np.concatenate(part) for part in zip(*parts, strict=True))
    joints = joint_forecasts(trust.validity, States(*states), deviation)
    return Forecast(
        str(stored.path),
        str(job) if isinstance(job, str | Path) else "",
        seconds,
        dict(zip(given.joint_names, joints, strict=True)),
        None if stored.error is None else stored.error.mean_relative_moving,
        torque_units(stored.robot),
        trust.usual(),
    )


def _series(motion: Segment, rate: float) -> Series:
    duration = motion.trajectory.duration
    t = np.linspace(0.0, duration, max(2, round(rate * duration) + 1))
    return Series(t, *motion.trajectory.states(t, motion.coefficients))
