import json
from dataclasses import asdict, fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.errors import FileError
from excite_cli.identification.identify import Identification, identify
from excite_cli.store.fit_file import read_fit, write_fit
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot

PROBLEM = """
robot: {urdf: x.urdf}
effects: [{kind: viscous_friction}, {kind: stribeck_friction, joints: [joint_2]}]
"""


@pytest.fixture(scope="module")
def found() -> Identification:
    robot = random_robot(3, joints=3, prismatic=False)
    data = measured(robot, standard_parameters(robot), noise=0.1, seconds=5.0, seeds=(1, 2, 3))
    return identify(robot, find_base_parameters(robot), data, parse_spec(PROBLEM))


def same(first: object, second: object) -> bool:
    if isinstance(first, np.ndarray):
        return isinstance(second, np.ndarray) and np.array_equal(first, second)
    if hasattr(first, "__dataclass_fields__") and not hasattr(first, "kind"):
        names = [field.name for field in fields(first)]  # type: ignore[arg-type]
        return all(same(getattr(first, name), getattr(second, name)) for name in names)
    return first == second


def test_what_is_written_is_read(found: Identification, tmp_path: Path) -> None:
    path = tmp_path / "fit.h5"
    write_fit(path, found, PROBLEM, "/somewhere", "abc", ("a.h5",))
    stored = read_fit(path)
    assert same(stored.fit, found.fit)
    assert stored.error == found.error
    assert stored.training_error == found.training_error
    assert stored.findings == found.findings
    assert (stored.held_out_run, stored.config, stored.config_folder) == (
        "r3",
        PROBLEM,
        "/somewhere",
    )
    assert (stored.fingerprint, stored.sources) == ("abc", ("a.h5",))


def test_traces_come_back(found: Identification, tmp_path: Path) -> None:
    path = tmp_path / "fit.h5"
    write_fit(path, found, PROBLEM, "/somewhere", "abc")
    stored = read_fit(path)
    assert [(t.run, t.held_out) for t in stored.traces] == [
        ("r1", False),
        ("r2", False),
        ("r3", True),
    ]
    for written, read in zip(found.traces, stored.traces, strict=True):
        for name in ("t", "q", "v", "a", "load", "measured", "counted", "predicted"):
            one, other = getattr(written, name), getattr(read, name)
            assert np.array_equal(one, other, equal_nan=True), name
        assert read.before is None
    assert stored.torque_units == ("N·m",) * 3
    assert stored.closed_loop_bias == found.hausman.sentence()
    assert stored.processing["rate"] == found.processing.rate


def test_links_come_back_and_are_those_of_the_bodies(found: Identification, tmp_path: Path) -> None:
    path = tmp_path / "fit.h5"
    marked = replace(found.fit.links[0], marks=("mass 9 kg where the URDF has 1 kg",))
    fit = replace(found.fit, links=(marked, *found.fit.links[1:]))
    write_fit(path, replace(found, fit=fit), PROBLEM, "/somewhere", "abc")
    assert read_fit(path).fit.links == fit.links
    with h5py.File(path, "a") as file:
        del file["fit/records/links"]
        file["fit/records/links"] = json.dumps([asdict(marked)])  # of three bodies
    with pytest.raises(FileError, match="damaged"):
        read_fit(path)


def test_the_traces_are_what_the_errors_say(found: Identification) -> None:
    held_out = found.traces[-1]
    left = held_out.measured - held_out.predicted
    for j, name in enumerate(found.fit.joint_names):
        rms = np.sqrt(np.nanmean(left[:, j] ** 2))
        assert found.error.rms[name] == pytest.approx(rms, rel=1e-3)


def test_the_noise_floor_comes_back(found: Identification, tmp_path: Path) -> None:
    path = tmp_path / "fit.h5"
    write_fit(path, replace(found, noise_floor={"joint_1": 0.25}), PROBLEM, "/somewhere", "abc")
    assert read_fit(path).noise_floor == {"joint_1": 0.25}


def test_foreign_and_damaged_files_give_one_message(found: Identification, tmp_path: Path) -> None:
    text = tmp_path / "text.h5"
    text.write_text("hello")
    with pytest.raises(FileError, match="not a readable HDF5"):
        read_fit(text)
    foreign = tmp_path / "foreign.h5"
    with h5py.File(foreign, "w") as file:
        file["x"] = 1
    with pytest.raises(FileError, match="not a fit of this program"):
        read_fit(foreign)
    path = tmp_path / "fit.h5"
    for spoil in ("fit/values", "fit/noise", "fit/names"):
        write_fit(path, found, PROBLEM, "/", "abc")
        with h5py.File(path, "a") as file:
            del file[spoil]
        with pytest.raises(FileError, match="damaged"):
            read_fit(path)
    write_fit(path, found, PROBLEM, "/", "abc")
    with h5py.File(path, "a") as file:
        file.attrs["schema"] = 99
    with pytest.raises(FileError, match="schema 99"):
        read_fit(path)
