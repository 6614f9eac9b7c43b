"""A robot that stands: motions played in MuJoCo, known by its soles and an inertial unit."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli import identify, load_case, load_problem, plan
from excite_cli.api.loading import measured_case
from tests.base_link.stander import write
from tests.cli.program import Installed

CONFIG = """
robot: {urdf: stander.urdf, base: floating, rows: ROWS}
trajectory: {family: fourier, base_frequency: 1.2566, harmonics: 5}
constraints: {joint_limits: {acceleration: 8.0}}
measurement:
  wrench: [{channel: left_sole, link: left_sole}, {channel: right_sole, link: right_sole}]
  base: {imu: {link: unit}}
optimizer: {restarts: 1, max_iterations: 60}
sequence: {motions: 3}
seed: 3
"""
ROWS = {"base.yaml": "[base]", "both.yaml": "[base, joints]"}
PLAYED = ("--rate", "200", "--inertia-error", "0.1", "--seed", "2")
TILT = ("--effect", "base_tilt@all=0.01,pitch:0.0524")
LOAD = ("--effect", "payload@left_hand=1.5;runs:motion_2")
SCALE = ("--effect", "wrench_gain@all=0.04")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """URDF, configs and motions; nothing of it is changed."""
    folder = tmp_path_factory.mktemp("stander")
    write(folder)
    for name, rows in ROWS.items():
        (folder / name).write_text(CONFIG.replace("ROWS", rows), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def motions(folder: Path) -> Path:
    plan(load_problem(folder / "base.yaml"), output=folder / "motions.h5")
    return folder / "motions.h5"


Recording = Callable[..., str]


@pytest.fixture
def record(excite: Installed, folder: Path, motions: Path) -> Recording:
    """Writes `log.h5` of a robot with these effects; says the config's path."""

    def played(name: str, *effects: str) -> str:
        config = str(folder / name)
        excite.answer("simulate", config, str(motions), "-o", "log.h5", *PLAYED, *effects)
        return config

    return played


def true_parameters(folder: Path) -> Any:
    """Those of the simulated robot, whose bodies are not those of the URDF."""
    with h5py.File(folder / "log.h5") as file:
        return np.array(json.loads(str(file.attrs["truth"]))["phi"])


@pytest.mark.parametrize("name", ROWS)
def test_base_parameters_are_within_their_intervals(
    record: Recording, tmp_path: Path, name: str
) -> None:
    case = load_case(record(name))
    found = identify(case, tmp_path / "log.h5")
    base = measured_case(case).base  # type: ignore[union-attr]
    truth, fit = base.mapping @ true_parameters(tmp_path), found.fit
    missed = (fit.values[: fit.rank] - truth) / fit.std[: fit.rank]
    assert np.mean(np.abs(missed) < 2.0) > 0.85
    assert np.abs(missed).max() < 4.5
    weight = int(np.argmax(np.abs(truth)))  # of all of it, which the soles carry
    assert fit.values[weight] == pytest.approx(truth[weight], rel=2e-3)
    assert fit.std[weight] < 5e-3 * truth[weight]
    assert max(x for x in found.error.rms.values() if np.isfinite(x)) < 2.0


def error(found: dict[str, Any], when: str) -> float:
    """Mean over the rows that were measured."""
    by_row = found["error"][when]["relative_moving"].values()
    return float(np.mean([x for x in by_row if x is not None]))


@pytest.mark.parametrize(
    ("name", "planted", "kind", "joints", "sizes"),
    [
        ("base.yaml", TILT, "base_tilt", None, {"roll": 0.01, "pitch": 0.0524}),
        ("both.yaml", TILT, "base_tilt", None, {"roll": 0.01, "pitch": 0.0524}),
        ("base.yaml", LOAD, "payload", ["left_elbow"], {"mass": 1.5}),
        ("both.yaml", LOAD, "payload", ["left_elbow"], {"mass": 1.5}),
        ("both.yaml", SCALE, "wrench_gain", None, {"gain": 0.04}),
    ],
)  # fmt: skip
def test_what_is_missing_has_its_name_and_size(
    excite: Installed, record: Recording, name: str, planted: tuple[str, ...],
    kind: str, joints: list[str] | None, sizes: dict[str, float],
) -> None:  # fmt: skip
    found: dict[str, Any] = excite.answer("diagnose", record(name, *planted), "log.h5")
    (effect,) = [each for each in found["effects"] if each["kind"] == kind]
    assert {e["kind"] for e in found["effects"] if e["verdict"] == "confirmed"} <= {kind}
    assert joints is None or effect["joints"] == joints
    for parameter, size in sizes.items():
        told = effect["parameters"][parameter]
        assert abs(told["value"] - size) < 3.0 * told["std"] + 0.02 * abs(size)
    if kind != "payload":  # in a run that trains; the held-out one has none
        before, after = (error(found, when) for when in ("before", "after"))
        assert after < (0.99 if kind == "wrench_gain" else 0.7) * before


WEIGHED_LOAD = (
    "identification.known_payload="
    "{runs: [motion_2], mass: 5.0, center: [0, 0, -0.1], link: left_hand}"
)
CARRIED = ("--effect", "payload@left_hand=5,cz:-0.1;runs:motion_2")


def weighed_robot(folder: Path) -> str:
    """What scales say."""
    mass = true_parameters(folder)[::10].sum()
    return f"identification.total_mass={{mass: {mass:.4f}, std: 0.03}}"


@pytest.mark.parametrize("load", [CARRIED, ()], ids=["a load", "the robot"])
@pytest.mark.parametrize("scale", [SCALE, ()], ids=["wrong", "right"])
def test_what_was_weighed_tells_the_scale_of_the_wrench(
    excite: Installed, tmp_path: Path, record: Recording, load: tuple[str, ...],
    scale: tuple[str, ...],
) -> None:  # fmt: skip
    """Without it, all masses would take it up."""
    config = record("base.yaml", *scale, *load)
    known = WEIGHED_LOAD if load else weighed_robot(tmp_path)
    data = (config, "log.h5", "--set", known)
    fitted, found = excite.answer("identify", *data), excite.answer("diagnose", *data)
    size = 0.04 if scale else 0.0
    (gain,) = [x for x in fitted["parameters"] if x["name"].startswith("wrench_gain.gain")]
    assert abs(gain["value"] - size) < 3.0 * gain["std"]
    assert gain["std"] < 0.005
    assert not [each for each in found["absorbed"] if each["kind"] == "wrench_gain"]
    assert [each["kind"] for each in found["effects"]] == ["wrench_gain"] * bool(scale)
    assert not found["approximations"]
    for named in found["effects"]:
        told = named["parameters"]["gain"]
        assert abs(told["value"] - size) < 3.0 * told["std"] + 0.002
        assert told["std"] < 0.005
        assert named["verdict"] == "based on the known mass"
        # A load tells a scale from an offset of the vertical force, the robot's weight does not.
        others = {each["kind"] for each in named["alias_set"]}
        assert ("torque_offset" in others) == (not load)


def test_a_scale_that_masses_take_up_is_told_with_what_settles_it(
    excite: Installed, record: Recording
) -> None:
    run = excite("diagnose", record("base.yaml", *SCALE), "log.h5")
    assert run.returncode == 0
    assert (
        "Wrong scale of the measured wrench becomes identifiable if the robot's mass is known "
        "(identification.total_mass)" in run.stdout
    )


@pytest.mark.parametrize(
    ("planted", "kind", "size"),
    [(TILT, "base_tilt", 0.0524), (LOAD, "payload", 1.5), ((), "", 0.0)],
)
def test_a_weighed_robot_changes_nothing_of_what_is_found(
    excite: Installed, tmp_path: Path, record: Recording, planted: tuple[str, ...],
    kind: str, size: float,
) -> None:  # fmt: skip
    config = record("base.yaml", *planted)
    known = ("--set", weighed_robot(tmp_path)) if planted else ()
    effects = excite.answer("diagnose", config, "log.h5", *known)["effects"]
    assert [each["kind"] for each in effects] == [kind] * bool(planted)
    for effect in effects:
        told = effect["parameters"]["mass" if kind == "payload" else "pitch"]
        assert abs(told["value"] - size) < 3.0 * told["std"] + 0.02 * size


def test_the_loop_goes_on(excite: Installed, folder: Path, record: Recording) -> None:
    """Diagnosed, applied, scored; the next motion is planned on top of the data."""
    first, applied = record("base.yaml", *TILT), str(folder / "applied.yaml")
    excite.answer("diagnose", first, "log.h5", "-o", "found.h5", "--apply", applied)
    scored = excite.answer("score", "found.h5", "log.h5")
    assert not any(run["alarm"] for run in scored["runs"])
    assert excite.answer("diagnose", applied, "log.h5")["effects"] == []
    brief = ("--motions", "1", "--set", "optimizer.max_iterations=30")
    planned = excite.answer("optimize", first, "--after", "found.h5", "-o", "next.h5", *brief)
    (motion,) = planned["motions"]
    assert motion["stacked_condition_number"] < 0.9 * motion["condition_number"]
