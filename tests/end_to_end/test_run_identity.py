"""Effects of single runs follow the recording, whatever it is called and wherever it is cut.

Simulated with MuJoCo, read and checked as a measured file, identified and diagnosed: an offset of
6 N·m on one joint in one of three recordings.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import ConfigError
from excite_cli.identification.identify import Identification, identify
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.missing_values import rows_of
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.cli.program import SMOKE
from tests.diagnosis.simulated_arm import BASE, PITCH, ROBOT, motion, planted

SECONDS, RATE, OFFSET = 6.0, 250.0, 6.0
GAP = (2.5, 2.8)  # s
NAMES = ("a", "b", "c")


@pytest.fixture(scope="module")
def recorded() -> Dataset:
    motions = [replace(motion(k, SECONDS), name=name) for k, name in enumerate(NAMES)]
    offset = planted("torque_offset", PITCH, OFFSET)
    offset = replace(offset, effect=replace(offset.effect, runs=("b",)))
    settings = SimulationSettings(rate=RATE, lead_in=0.5)
    return simulate(ROBOT, motions, settings, [offset]).dataset


def spec_of(*runs: str) -> Spec:
    """The offset declared for `runs`, beside the friction that the arm has."""
    joint = ROBOT.joint_names[1]
    listed = ", ".join(f'"{run}"' for run in runs)
    declared = f"{{kind: torque_offset, joints: [{joint}], runs: [{listed}]}}"
    return load_spec(
        SMOKE,
        [
            f"effects=[{{kind: viscous_friction}}, {{kind: coulomb_friction}}, {declared}]",
            "diagnosis.kinds=[armature, spring]",
            "identification.consistent=false",
        ],
    )


def renamed(dataset: Dataset, *names: str) -> Dataset:
    runs = zip(dataset.runs, names, strict=True)
    return replace(dataset, runs=tuple(replace(run, name=name) for run, name in runs))


def with_gap(run: Run) -> Run:
    kept = (run.t < GAP[0]) | (run.t >= GAP[1])
    return replace(rows_of(run, kept), extra={})


def read_again(dataset: Dataset, folder: Path, spec: Spec) -> Dataset:
    path = folder / "log.h5"
    write_dataset(path, dataset, {})
    return read_dataset([path], spec.measurement, dataset.joint_names)


def declared_offset(found: Identification | Diagnosis) -> float:
    """The offset that a fit or a diagnosis gives to the declared effect."""
    if isinstance(found, Identification):
        (index,) = [k for k, e in enumerate(found.fit.effects) if e.kind == "torque_offset"]
        return float(found.fit.effect_values(index)[0])
    (record,) = [each for each in found.information.model if each.kind == "torque_offset"]
    return record.values[0]


@pytest.mark.parametrize(
    "names",
    [NAMES, ("take 0-6 s", "take 6-12 s", "take 7-18 s"), ("x (1)", "x (first half)", "x 2-3 s")],
)
def test_an_offset_of_one_run_is_found_whatever_the_run_is_called(
    names: tuple[str, ...], recorded: Dataset, tmp_path: Path
) -> None:
    spec = spec_of(names[1])
    dataset = read_again(renamed(recorded, *names), tmp_path, spec)
    assert dataset.recordings == names
    for call in (identify, diagnose):
        found: Any = call(ROBOT, BASE, dataset, spec)
        assert declared_offset(found) == pytest.approx(OFFSET, abs=0.1)
        assert found.held_out_run == names[2]


@pytest.mark.parametrize("cut", ["b", "abc"])
def test_an_offset_of_one_run_is_found_on_both_sides_of_a_gap(
    cut: str, recorded: Dataset, tmp_path: Path
) -> None:
    spec = spec_of("b")
    runs = tuple(with_gap(run) if run.name in cut else run for run in recorded.runs)
    dataset = read_again(replace(recorded, runs=runs), tmp_path, spec)
    assert dataset.recordings == NAMES
    assert len(dataset.runs) == len(NAMES) + len(cut)
    fitted = identify(ROBOT, BASE, dataset, spec)
    for found in (fitted, diagnose(ROBOT, BASE, dataset, spec)):
        assert declared_offset(found) == pytest.approx(OFFSET, abs=0.1)
        assert found.held_out_run == "c"
    held_out = [trace.run for trace in fitted.traces if trace.held_out]
    assert held_out == (["c/1", "c/2"] if "c" in cut else ["c"])


def test_an_offset_of_the_held_out_run_counts_for_the_error(recorded: Dataset) -> None:
    """With the offset declared, b and c are held out in turn and predicted alike."""
    spec = spec_of("b", "c")
    offset = OFFSET * np.eye(ROBOT.n)[1]
    *others, last = recorded.runs
    both = replace(recorded, runs=(*others, replace(last, tau=last.tau + offset)))
    error = identify(ROBOT, BASE, both, spec, held_out="c").error
    without = identify(ROBOT, BASE, both, spec_of("b"), held_out="c").error
    assert error.rms[ROBOT.joint_names[1]] < 1.0 < without.rms[ROBOT.joint_names[1]]


def test_a_stretch_may_be_named_alone(recorded: Dataset, tmp_path: Path) -> None:
    first, second, third = recorded.runs
    later = second.t >= GAP[1]
    half = replace(second, tau=second.tau - OFFSET * np.eye(ROBOT.n)[1] * ~later[:, None])
    spec = spec_of("b/2")
    dataset = read_again(replace(recorded, runs=(first, with_gap(half), third)), tmp_path, spec)
    assert declared_offset(identify(ROBOT, BASE, dataset, spec)) == pytest.approx(OFFSET, abs=0.1)


@pytest.mark.parametrize("call", [identify, diagnose])
def test_runs_that_are_not_there_or_held_out_are_refused(
    call: Callable[..., Any], recorded: Dataset
) -> None:
    """Of an effect of the held-out run alone nothing would be fitted; its error be all its own."""
    dataset = renamed(recorded, "slow", "payload", "take 6-12 s")
    for runs, words in (
        (
            ("slow", "paylod"),
            "effects[2].runs: there is no run 'paylod' in the data. Did you mean 'payload'? "
            "Runs: slow, payload, take 6-12 s.",
        ),
        (
            ("take 6-12 s",),
            "effects[2].runs: 'take 6-12 s' is held out, so that nothing is left to fit "
            "torque_offset on. Hold out another run: --held-out 'payload'.",
        ),
    ):
        with pytest.raises(ConfigError) as error:
            call(ROBOT, BASE, dataset, spec_of(*runs))
        assert str(error.value) == words
    call(ROBOT, BASE, dataset, spec_of("take 6-12 s"), "payload")
