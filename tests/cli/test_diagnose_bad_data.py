"""Damaged recordings through the installed program: each mistake gets its own message."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from excite_cli.api.loading import Case, load_data
from excite_cli.checks.all_checks import check_dataset
from excite_cli.config.load_spec import load_spec
from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.missing_values import rows_of
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.cli.program import ROOT, SMOKE, Program
from tests.diagnosis.simulated_arm import ELBOW, ROBOT, planted
from tests.measurement.recordings import write_csv
from tests.simulation.arms import about_posture

NAMES = ("shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide")
Change = Callable[[Any], Any]


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The smoke arm, tracing three kinds only: what is tested is the reading."""
    tree = yaml.safe_load(SMOKE.read_text())
    tree["robot"]["urdf"] = str((SMOKE.parent / tree["robot"]["urdf"]).resolve())
    tree["diagnosis"] = {"kinds": ["viscous_friction", "coulomb_friction", "torque_offset"]}
    path = tmp_path_factory.mktemp("bad_data") / "arm.yaml"
    path.write_text(yaml.safe_dump(tree))
    return path


@pytest.fixture(scope="module")
def recorded() -> Dataset:
    """Two runs of an arm whose elbow has dry friction that nobody declared."""
    motions = [about_posture(ROBOT, f"run_{seed}", seed, 6.0) for seed in (1, 2)]
    settings = SimulationSettings(rate=200.0, lead_in=0.3)
    return simulate(ROBOT, motions, settings, [planted("coulomb_friction", ELBOW, 3.0)]).dataset


def damaged(recorded: Dataset, changes: dict[str, Change]) -> Dataset:
    """With the named channels of every run changed."""

    def of(run: Run) -> Run:
        made = {name: change(getattr(run, name)) for name, change in changes.items()}
        return replace(run, extra={}, **made)

    return replace(recorded, runs=tuple(map(of, recorded.runs)))


def times(*factors: float) -> Change:
    return lambda values: values * np.array(factors)


def flipped(joint: int) -> Change:
    return times(*(-1.0 if j == joint else 1.0 for j in range(5)))


def joints_in_order(*order: int) -> Change:
    return lambda values: values[:, list(order)]


def constant(joint: int, value: float) -> Change:
    return lambda values: np.where(np.arange(5) == joint, value, values)


NO_SPEEDS: dict[str, Change] = {"dq": lambda values: None}
MILLISECONDS, DEGREES = {"t": times(1e3)}, {"q": times(*[180 / np.pi] * 4, 1.0)}
CASES: dict[str, tuple[dict[str, Change], tuple[str, ...]]] = {
    "milliseconds": (MILLISECONDS, ("measurement.time: ms",)),
    "milliseconds, no speeds": (MILLISECONDS | NO_SPEEDS, ("measurement.time: ms",)),
    "degrees, no speeds": (DEGREES | NO_SPEEDS, ("measurement.angle: deg",)),
    "degrees": (DEGREES, ("positions are in degrees", "measurement.angle: deg")),
    "dead torque": ({"tau": constant(2, 0.0)}, ("torque of elbow is constant at 0",)),
    "constant torque": ({"tau": constant(1, 3.5)}, ("torque of shoulder_pitch is constant",)),
    "dead position": ({"q": constant(2, 0.4)}, ("position of elbow is constant",)),
    "speed of other sign": ({"dq": flipped(2)}, ("recorded speed of elbow", "velocity_sign")),
    "swapped torques": (
        {"tau": joints_in_order(0, 2, 1, 3, 4)},
        ("torques of shoulder_pitch and elbow are swapped",),
    ),
    "reversed torques": (
        {"tau": joints_in_order(4, 3, 2, 1, 0)},
        ("torques are in another order",),
    ),
    "all torque signs": (
        {"tau": times(-1.0)},
        ("torque of every joint has the opposite sign", "measurement.sign"),
    ),
    "position sign": (
        {"q": flipped(2), "dq": flipped(2)},
        ("position of elbow has the opposite sign", "measurement.position_sign: {elbow: -1}"),
    ),
    **{
        f"torque sign of {name}": (
            {"tau": flipped(j)},
            (f"torque of {name} has the opposite sign", f"measurement.sign: {{{name}: -1}}"),
        )
        for j, name in enumerate(NAMES)
    },
}


@pytest.mark.parametrize("case", ["milliseconds", "dead torque", "torque sign of elbow"])
def test_the_program_ends_with_the_message(
    case: str, recorded: Dataset, config: Path, excite: Program
) -> None:
    changes, words = CASES[case]
    write_dataset(excite.folder / "data.h5", damaged(recorded, changes), {})
    told = excite.refused("diagnose", config, "data.h5")
    assert all(word in told for word in words), told


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_every_mistake_has_its_message(
    case: str, recorded: Dataset, config: Path, tmp_path: Path
) -> None:
    """The way `diagnose` and `identify` take from the file, without a process for each case."""
    changes, words = CASES[case]
    write_dataset(tmp_path / "data.h5", damaged(recorded, changes), {})
    spec = load_spec(config)
    with pytest.raises(FileError) as told:  # noqa: PT012 - either may be the one that tells
        data = load_data(Case(spec, config.parent, ROBOT), tmp_path / "data.h5")
        check_dataset(ROBOT, data, spec)
    assert all(word in str(told.value) for word in words), told.value


@pytest.mark.long
def test_names_in_another_order_are_told_by_diagnose_and_identify(
    recorded: Dataset, config: Path, excite: Program
) -> None:
    """Of an HDF5 file and of a CSV table, whose columns are matched by name."""
    order = [0, 2, 1, 3, 4]
    names = tuple(recorded.joint_names[j] for j in order)
    write_dataset(excite.folder / "data.h5", replace(recorded, joint_names=names), {})
    write_csv(excite.folder / "data.csv", replace(recorded.runs[0], dq=None), names)
    for command, file in (("diagnose", "data.csv"), ("identify", "data.h5")):
        said = excite.refused(command, config, file)
        assert "columns of shoulder_pitch and elbow are swapped" in said
        assert "measurement.names: {" in said
        assert "measurement.trust: [order of columns]" in said


def test_a_gap_and_missing_values_are_warned_of_and_the_diagnosis_is_right(
    recorded: Dataset, config: Path, excite: Program
) -> None:
    first, second = (replace(run, dq=None, extra={}) for run in recorded.runs)
    broken = first.tau.copy()
    broken[400:420, 1] = np.nan
    second = rows_of(second, (second.t < 2.0) | (second.t > 2.3))
    write_csv(excite.folder / "nan.csv", replace(first, tau=broken), recorded.joint_names)
    write_csv(excite.folder / "gap.csv", second, recorded.joint_names)
    run = excite.good("diagnose", config, "nan.csv", "gap.csv", "--json")
    said = " ".join(run.stderr.split())
    assert "warning (gap" in said
    assert "warning (nan" in said
    effects = json.loads(run.stdout)["effects"]
    assert [(e["kind"], e["joints"]) for e in effects] == [("coulomb_friction", ["elbow"])]
    value = effects[0]["parameters"]["coulomb"]["value"]
    assert value == pytest.approx(3.0, rel=0.15)


def test_a_bag_cut_short(excite: Program, config: Path) -> None:
    pytest.importorskip("rosbags")
    from tests.measurement.bags import write_bag
    from tests.measurement.recordings import recorded as short

    bag = write_bag(excite.folder / "bag", short())
    data = next(bag.glob("*.db3"))
    cut = excite.folder / "cut.db3"
    cut.write_bytes(data.read_bytes()[: data.stat().st_size // 2])
    assert "cut.db3" in excite.refused("diagnose", config, "cut.db3")


def test_a_real_bag_cut_short(excite: Program) -> None:
    folder = ROOT / "data" / "ur10_cb"
    whole = (folder / "ur10_exciting_trajectory.db3").read_bytes()
    (excite.folder / "cut.db3").write_bytes(whole[: len(whole) // 2])
    problem = {"robot": {"urdf": str(folder / "ur10.urdf")}}
    (excite.folder / "ur10.yaml").write_text(yaml.safe_dump(problem))
    assert "cut.db3" in excite.refused("diagnose", "ur10.yaml", "cut.db3")
