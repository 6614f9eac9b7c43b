"""What error of a model to expect on a motion to come, and where that leaves its own data."""

from dataclasses import dataclass
from math import nan

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.scoring.tolerance import TOLERATED
from excite_cli.scoring.validity import States, Validity
from excite_cli.shown.answer import Shown

_FAR = 1.1  # times the speed or load of the model's own data: less is not outside
_OFTEN = 0.01  # of the samples: fewer outside are not told


@dataclass(frozen=True)
class JointForecast:
    """Of one joint over a job: RMS `torque` and expected `error` where it moves [N·m] (N).

    `faster`, `heavier` and `farther`: shares of the samples clearly beyond the speeds, loads and
    positions of the model's own data; `fastest`, `heaviest`, `farthest`: how many times these at
    most, positions from the middle of the own ones. NaN where the data say nothing, or it stands.
    """

    torque: float
    error: float
    faster: float
    heavier: float
    farther: float
    fastest: float
    heaviest: float
    farthest: float

    @property
    def share(self) -> float:
        """Expected error over torque."""
        return self.error / self.torque if self.torque > 0.0 else nan

    @property
    def outside(self) -> bool:
        """Whether the job goes where the model's own data were not."""
        return max(self.faster, self.heavier, self.farther) > _OFTEN


@dataclass(frozen=True, repr=False)
class Forecast(Shown):
    """The error of `model` to expect where joints move, on the motion of the file `job`.

    It is `seconds` long. `joints` by name; `made`: error when the model was made, on data held out,
    as a share of the torque (None if not known). `torque_units` of the joints. `usual`: what the
    same formula expects on the model's own data, those held out if any.
    """

    model: str
    job: str
    seconds: float
    joints: dict[str, JointForecast]
    made: float | None
    torque_units: tuple[str, ...]
    usual: float = nan

    @property
    def mean_share(self) -> float:
        """Expected error over torque, mean over the joints of which it is known."""
        known = [each.share for each in self.joints.values() if np.isfinite(each.share)]
        return float(np.mean(known)) if known else nan

    @property
    def outside(self) -> tuple[str, ...]:
        """Joints that go where the model's own data were not."""
        return tuple(name for name, each in self.joints.items() if each.outside)

    @property
    def good(self) -> bool:
        """Whether the error to expect is about that of the model's own data."""
        own = [x for x in (self.made, self.usual) if x is not None and np.isfinite(x)]
        return not own or not self.mean_share > TOLERATED * max(own)


def joint_forecasts(validity: Validity, states: States, deviation: Array) -> list[JointForecast]:
    """Of all joints, from states and the deviation (T, n) of their torques."""
    beyond = (*validity.beyond(states.v, states.load), validity.away(states.q))
    moves = validity.moves(states.v)
    count = np.where(moves.any(axis=0), moves.sum(axis=0), nan)
    both = np.square(np.where(moves, [states.torque, deviation], 0.0))
    rms = np.sqrt(both.sum(axis=1) / count)
    shares = (np.mean(x > _FAR, axis=0) for x in beyond)
    most = (x.max(axis=0) for x in beyond)
    figures = np.stack([*rms, *shares, *most], axis=1)
    return [JointForecast(*map(float, row)) for row in figures]
