"""`excite inspect` as a user runs it: a robot on its side, a wrong config, and what it writes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.robot.model import Robot
from tests.cli.program import Program
from tests.simulation.arms import arm

pytestmark = pytest.mark.long

CONFIG = """\
# the arm in the corner
robot: {urdf: "example-robot-data:ur10"}  # bolted to the wall
effects: [{kind: viscous_friction}, {kind: coulomb_friction}]
"""


def hanging(robot: Robot) -> Dataset:
    """On a wall, torques of the shoulder in mN·m."""
    dynamics = InverseDynamics(robot.with_gravity(np.array([0.0, -9.81, 0.0])))
    t = np.arange(0.0, 12.0, 0.005)
    rng = np.random.default_rng(1)
    runs = []
    for name, seed in (("a", 1), ("b", 2)):
        q, v, a = _motion(robot, t, seed)
        tau = dynamics.torques(q, v, a) + 3.0 * np.sign(v) + 2.0 * v
        tau += 0.05 * rng.normal(size=tau.shape)
        tau[:, 1] *= 1e3
        runs.append(Run(name, t, q, tau))
    return Dataset(robot.joint_names, tuple(runs))


def _motion(robot: Robot, t: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q, v, a = (np.zeros((len(t), robot.n)) for _ in range(3))
    for k in range(1, 5):
        w, phase = 2 * np.pi * 0.12 * k, rng.uniform(0, 2 * np.pi, robot.n)
        size = rng.normal(size=robot.n) * 0.8 / k
        angle = w * t[:, None] + phase
        q += size * np.sin(angle)
        v += size * w * np.cos(angle)
        a -= size * w * w * np.sin(angle)
    return q, v, a


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Program:
    """In a folder with arm.yaml and log.h5."""
    path = tmp_path_factory.mktemp("inspect")
    (path / "arm.yaml").write_text(CONFIG, encoding="utf-8")
    write_dataset(path / "log.h5", hanging(arm()), {})
    return Program(path, cache)


def text_of(program: Program, name: str) -> str:
    return (program.folder / name).read_text(encoding="utf-8")


def test_two_faults_their_keys_and_the_config_that_settles_them(program: Program) -> None:
    said = program("inspect", "arm.yaml", "log.h5", "--apply", "new.yaml", "--json")
    assert said.returncode == 1, said.stderr
    answer = json.loads(said.stdout)
    faults = {each["name"]: each for each in answer["checks"] if each["status"] != "ok"}
    assert set(faults) == {"direction of gravity", "unit of torques"}
    assert faults["direction of gravity"]["settings"] == {
        "robot.base_orientation": pytest.approx([np.pi / 2, 0.0, 0.0], abs=1e-3)
    }
    units = faults["unit of torques"]["settings"]["measurement.torque_unit"]
    assert units["shoulder_lift_joint"] == 0.001
    written = text_of(program, "new.yaml")
    assert "# the arm in the corner" in written
    assert "# bolted to the wall" in written
    program.refused("identify", "arm.yaml", "log.h5")  # with the same words
    again = program.good("inspect", "new.yaml", "log.h5")
    assert again.stdout.startswith("No faults and no doubts: ")
    assert "excite diagnose new.yaml log.h5" in again.stdout


def test_the_page_has_the_checks_the_evidence_and_the_keys(program: Program) -> None:
    said = program("inspect", "arm.yaml", "log.h5", "-o", "set-up.html", "--json")
    assert json.loads(said.stdout)["page"] == "set-up.html"
    page = text_of(program, "set-up.html")
    for text in (
        "1 of 25 checks found a fault, 1 to be looked at",
        "robot.base_orientation",
        "gravity is (",
        "What would change in the config",
    ):
        assert text in page
    assert "exists already" in program.refused("inspect", "arm.yaml", "-o", "set-up.html")
    assert text_of(program, "set-up.html") == page


def test_the_description_alone_and_nothing_to_apply(program: Program) -> None:
    said = program.good("inspect", "arm.yaml", "--apply", "same.yaml").stdout
    assert said.startswith("No faults and no doubts: 4 checks")
    assert "in which nothing is changed" in " ".join(said.split())
    assert text_of(program, "same.yaml") == CONFIG


def test_values_of_set_are_in_what_is_applied(program: Program) -> None:
    program.good("inspect", "arm.yaml", "--set", "seed=7", "--apply", "seven.yaml")
    text = text_of(program, "seven.yaml")
    assert "seed: 7" in text
    assert text.startswith(CONFIG)  # comments and all


def test_a_check_that_is_no_check(program: Program) -> None:
    trusted = ("--set", "measurement.trust=[direction of gravty]")
    said = program.refused("inspect", "arm.yaml", *trusted)
    assert "'direction of gravty' is no check. Did you mean 'direction of gravity'" in said


def test_a_bad_file_gets_one_message_and_loses_nothing(program: Program) -> None:
    (program.folder / "bad.h5").write_bytes((program.folder / "log.h5").read_bytes()[:3000])
    (program.folder / "kept.yaml").write_text("# mine\n", encoding="utf-8")
    program.refused("inspect", "arm.yaml", "bad.h5", "--apply", "kept.yaml", "--overwrite")
    assert text_of(program, "kept.yaml") == "# mine\n"


def test_what_settles_one_thing_and_spoils_the_data_is_not_set(program: Program) -> None:
    """Speeds 1e9 times too large ask for stamps in ns, with which the log lasts 12 ns."""
    data = hanging(arm())
    runs = tuple(replace(run, dq=1e9 * np.gradient(run.q, run.t, axis=0)) for run in data.runs)
    write_dataset(program.folder / "fast.h5", replace(data, runs=runs), {})
    said = program("inspect", "arm.yaml", "fast.h5", "--json")
    answer = json.loads(said.stdout)
    assert said.returncode == 1, said.stderr
    assert answer["settings"] == {}
    (vain,) = [each for each in answer["checks"] if "cannot be used" in each["evidence"]]
    assert vain["evidence"].startswith("with measurement.time: ns and ")
    assert "the data cannot be used: run 'a': samples come at 2e+11 Hz" in vain["evidence"]


def test_power_of_data_is_told_where_it_is_asked_for(program: Program) -> None:
    answer = json.loads(program("inspect", "arm.yaml", "log.h5", "--power", "--json").stdout)
    sizes = {(each["kind"], *each["joints"]): each for each in answer["power"]}
    assert ("viscous_friction", "elbow_joint") not in sizes  # is declared
    found = sizes["load_dependent_friction", "elbow_joint"]
    assert 0.0 < found["share_of_torque"] < 1.0
    plain = json.loads(program("inspect", "arm.yaml", "log.h5", "--json").stdout)
    assert "power" not in plain
    refused = program.refused("inspect", "arm.yaml", "--power")
    assert "--power is of measured data: give their files." in refused
