"""A robot that stands: motions played in MuJoCo, known by its soles and an inertial unit."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli import identify, load_case
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
    from excite_cli import load_problem, plan

    plan(load_problem(folder / "base.yaml"), output=folder / "motions.h5")
    return folder / "motions.h5"


def record(excite: Installed, config: Path, motions: Path, *effects: str) -> None:
    excite.answer("simulate", str(config), str(motions), "-o", "log.h5", *PLAYED, *effects)


@pytest.mark.parametrize("name", ROWS)
def test_base_parameters_are_within_their_intervals(
    excite: Installed, tmp_path: Path, folder: Path, motions: Path, name: str
) -> None:
    record(excite, folder / name, motions)
    case = load_case(folder / name)
    found = identify(case, tmp_path / "log.h5")
    with h5py.File(tmp_path / "log.h5") as file:
        phi = np.array(json.loads(str(file.attrs["truth"]))["phi"])
    base = measured_case(case).base  # type: ignore[union-attr]
    truth, fit = base.mapping @ phi, found.fit
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
    excite: Installed, folder: Path, motions: Path, name: str, planted: tuple[str, ...],
    kind: str, joints: list[str] | None, sizes: dict[str, float],
) -> None:  # fmt: skip
    record(excite, folder / name, motions, *planted)
    found: dict[str, Any] = excite.answer("diagnose", str(folder / name), "log.h5")
    assert [effect["kind"] for effect in found["effects"]] == [kind]
    (effect,) = found["effects"]
    assert joints is None or effect["joints"] == joints
    for parameter, size in sizes.items():
        told = effect["parameters"][parameter]
        assert abs(told["value"] - size) < 3.0 * told["std"] + 0.02 * abs(size)
    if kind != "payload":  # in a run that trains; the sealed one has none
        before, after = (error(found, when) for when in ("before", "after"))
        assert after < (0.99 if kind == "wrench_gain" else 0.7) * before


def test_a_weighed_load_tells_the_scale_of_the_wrench(
    excite: Installed, folder: Path, motions: Path
) -> None:
    """Without it, all masses would take it up."""
    load = ("--effect", "payload@left_hand=5,cz:-0.1;runs:motion_2")
    record(excite, folder / "base.yaml", motions, *SCALE, *load)
    weighed = "{runs: [motion_2], mass: 5.0, center: [0, 0, -0.1], link: left_hand}"
    found = excite.answer(
        "identify", str(folder / "base.yaml"), "log.h5", "--set",
        f"identification.known_payload={weighed}",
    )  # fmt: skip
    (gain,) = [x for x in found["parameters"] if x["name"].startswith("wrench_gain.gain")]
    assert abs(gain["value"] - 0.04) < 3.0 * gain["std"]
    assert gain["std"] < 0.005


def test_nothing_is_missing_where_nothing_is(
    excite: Installed, folder: Path, motions: Path
) -> None:
    record(excite, folder / "base.yaml", motions)
    assert excite.answer("diagnose", str(folder / "base.yaml"), "log.h5")["effects"] == []


def test_rows_of_the_base_need_a_wrench_in_the_data(
    excite: Installed, tmp_path: Path, folder: Path, motions: Path
) -> None:
    record(excite, folder / "base.yaml", motions)
    with h5py.File(tmp_path / "log.h5", "a") as file:
        for run in file["runs"].values():
            del run["left_sole"], run["tau"]  # torques are not missed
    for command in (["identify"], ["diagnose"]):
        run = excite(*command, str(folder / "base.yaml"), "log.h5")
        assert run.returncode == 2
        assert "no channel 'left_sole'" in run.stderr
        assert "measurement.wrench" in run.stderr
    run = excite("identify", str(folder / "both.yaml"), "log.h5")
    assert run.returncode == 2
    assert "has no dataset 'tau'" in run.stderr


def test_the_loop_goes_on(excite: Installed, tmp_path: Path, folder: Path, motions: Path) -> None:
    """Diagnosed, applied, scored; the next motion is planned on top of the data."""
    record(excite, folder / "base.yaml", motions, *TILT)
    first = str(folder / "base.yaml")
    excite.answer(
        "diagnose", first, "log.h5", "-o", "found.h5", "--apply", str(folder / "applied.yaml")
    )
    scored = excite.answer("score", "found.h5", "log.h5")
    assert not any(run["alarm"] for run in scored["runs"])
    again = excite.answer("diagnose", str(folder / "applied.yaml"), "log.h5")
    assert again["effects"] == []
    brief = ("--motions", "1", "--set", "optimizer.max_iterations=30")
    planned = excite.answer("optimize", first, "--after", "found.h5", "-o", "next.h5", *brief)
    (motion,) = planned["motions"]
    assert motion["stacked_condition_number"] < 0.9 * motion["condition_number"]
