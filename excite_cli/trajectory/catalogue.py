"""All trajectory families by their name in the YAML file."""

from excite_cli.config.trajectory_spec import BSplineSpec, FourierSpec
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory


def build_trajectory(spec: FourierSpec | BSplineSpec) -> Trajectory:
    """The trajectory family that `spec` asks for, with its number of coefficients filled in."""
    if isinstance(spec, FourierSpec):
        assert spec.harmonics is not None
        return FourierTrajectory(spec.harmonics, spec.base_frequency, spec.at_rest)
    assert spec.control_points is not None
    return BSplineTrajectory(spec.duration, spec.control_points, spec.degree, spec.at_rest)
