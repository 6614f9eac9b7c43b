"""Motions to be exported by tests."""

import numpy as np

from excite_cli.export.timed import timed_motion
from excite_cli.measurement.timed_motion import TimedMotion
from excite_cli.trajectory.fade import Chain, Segment
from excite_cli.trajectory.fourier import FourierTrajectory

# Names that a careless writer of YAML, CSV or JSON trips over.
JOINTS = ("shoulder_pan", "q_odd name: [1]", "on", "ünder/ns, 7", "01")


def chain(frequency: float = 0.77, joints: int = len(JOINTS)) -> Chain:
    """One period of a Fourier series whose duration is no whole number of steps."""
    series = FourierTrajectory(4, frequency)
    alpha = np.random.default_rng(8).normal(size=(9, joints))
    alpha[:, 2] *= 1e-7  # numbers that are written with an exponent
    return Chain((Segment("motion_1", series, alpha),))


def motion(rate: float = 100.0, whole_nanoseconds: bool = False) -> TimedMotion:
    """Its samples."""
    return timed_motion("motion_1", JOINTS, chain(), rate, False, whole_nanoseconds)
