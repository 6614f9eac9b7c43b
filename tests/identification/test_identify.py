"""From a dataset to parameters: splits, findings, bias."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ConfigError
from excite_cli.identification.identify import Identification, identify
from excite_cli.measurement.dataset import Dataset
from excite_cli.simulation.build import true_inertias
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot

SPEC = parse_spec(
    "{robot: {urdf: x}, effects: [{kind: viscous_friction}, {kind: coulomb_friction}]}"
)
VALUES = np.array([1.0, 2.0, 0.5, 3.0, 1.0, 2.0])
ROBOT = random_robot(3, joints=3, prismatic=False)
TRUTH = true_inertias(ROBOT, 0.2, seed=1)
EFFECTS = declared_effects(SPEC.effects, ROBOT)


@pytest.fixture(scope="module")
def data() -> Dataset:
    return measured(ROBOT, TRUTH, EFFECTS, VALUES, noise=0.2, memory=0.7, seeds=(1, 2, 3))


def run(data: Dataset, spec: Spec = SPEC, held_out: str | None = None) -> Identification:
    return identify(ROBOT, find_base_parameters(ROBOT), data, spec, held_out)


def test_the_held_out_run_does_not_touch_the_fit(data: Dataset) -> None:
    last = data.runs[-1]
    spoiled = replace(last, tau=last.tau + 50.0, q=last.q)
    other = replace(data, runs=(*data.runs[:-1], spoiled))
    first, second = run(data), run(other)
    assert np.array_equal(first.fit.values, second.fit.values)
    assert first.held_out_run == "r3"
    assert run(data, held_out="r1").held_out_run == "r1"
    with pytest.raises(ConfigError, match=r"no run 'r9'.*r1, r2, r3"):
        run(data, held_out="r9")
    assert second.error.mean_relative > 3 * first.error.mean_relative
    assert first.error.mean_relative == pytest.approx(first.training_error.mean_relative, rel=0.5)


def test_a_single_run_is_cut_into_blocks_and_a_torque_of_the_wrong_sign_is_noticed(
    data: Dataset,
) -> None:
    found = run(replace(data, runs=data.runs[:1]))
    assert "blocks" in found.held_out_run
    assert found.fit.values[found.fit.rank :] == pytest.approx(VALUES, rel=0.15)
    # A torque of the wrong sign is noticed.
    runs = tuple(replace(run, tau=-run.tau) for run in data.runs)
    found = run(replace(data, runs=runs))
    texts = [finding.text for finding in found.findings if finding.kind == "negative"]
    assert len(texts) == 1
    assert "sign of the torque" in texts[0]
    assert not any(finding.kind == "negative" for finding in run(data).findings)


def test_bias_is_tested_with_the_reference_and_said_to_be_untestable_without(data: Dataset) -> None:
    found = run(data)
    assert not found.hausman.testable
    assert "not testable" in found.hausman.sentence()
    planned = tuple(replace(run, extra={"q_ref": run.q}) for run in data.runs)
    rng = np.random.default_rng(0)
    clean = [replace(run, q=run.q + 1e-6 * rng.normal(size=run.q.shape)) for run in planned]
    found = run(replace(data, runs=tuple(clean)))
    assert found.hausman.testable
    assert found.hausman.source == "reference"
    assert found.hausman.p_value > 0.001
