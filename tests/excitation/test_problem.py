"""Samples that are not given follow from the trajectory; parts left unguarded are refused."""

import numpy as np
import pytest

from excite_cli.config.load import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError
from excite_cli.excitation.problem import instants, with_sampling
from excite_cli.trajectory.catalogue import build_trajectory
from excite_cli.trajectory.freedom import with_freedom


def _filled(text: str) -> Spec:
    spec = parse_spec(f"robot: {{urdf: a}}\n{text}")
    spec = spec.model_copy(update={"trajectory": with_freedom(spec.trajectory, np.full(2, 10.0))})
    return with_sampling(spec, build_trajectory(spec.trajectory))


@pytest.mark.parametrize(
    "text",
    [
        "trajectory: {family: bspline, duration: 12}",
        "trajectory: {harmonics: 3, base_frequency: 1.0}",
        "trajectory: {harmonics: 20, base_frequency: 0.1}",
        "trajectory: {family: bspline, duration: 0.5}\nsampling: {cost: {samples: 30}}",
        "trajectory: {base_frequency: 0.5}\nsampling: {constraints: {step: 0.05}}",
    ],
)
def test_default_grids_cover_the_trajectory_exactly(text: str) -> None:
    spec = _filled(text)
    trajectory = build_trajectory(spec.trajectory)
    for grid in (spec.sampling.cost, spec.sampling.constraints):
        times = instants(grid)
        assert times[0] == 0
        assert times[-1] < trajectory.duration
        covered = times[-1] + times[1]
        assert covered == pytest.approx(trajectory.duration, rel=0.05)
    times = instants(spec.sampling.constraints)
    assert np.diff(times)[0] <= max(0.0201, trajectory.duration / 1000) or "step" in text
    assert len(instants(spec.sampling.cost)) >= min(30, trajectory.n_coefficients)


def test_what_is_given_is_kept() -> None:
    spec = _filled("sampling: {cost: {samples: 40, step: 0.2}, constraints: {samples: 400}}")
    assert (spec.sampling.cost.samples, spec.sampling.cost.step) == (40, 0.2)
    assert spec.sampling.constraints.step == pytest.approx(0.02, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "trajectory: {base_frequency: 0.5}\n"
            "sampling: {constraints: {samples: 400, step: 0.02}}",
            "cover 8 s of a trajectory of 12.5664 s; the constraints would not hold in",
        ),
        ("sampling: {cost: {samples: 100, step: 0.2}}", "last longer than the trajectory"),
        ("trajectory: {base_frequency: 1.0e-4}", "longer than the 3600 s"),
    ],
)
def test_grids_that_do_not_fit_are_refused(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        _filled(text)
