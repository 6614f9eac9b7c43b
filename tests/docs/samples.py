"""Files that pages of documentation work on, made once from the small arm of `data/`."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from excite_cli import (
    Case,
    Dataset,
    diagnose,
    identify,
    load_case,
    load_data,
    load_problem,
    plan,
    read_result,
    save_fit,
    simulate,
    write_dataset,
)
from excite_cli.simulation.settings import SimulationSettings
from tests.cli.program import ROOT
from tests.measurement.recordings import named, write_table

_STANDING = "  base: floating\n  rows: [base]\n"
_SENSORS = """
measurement:
  wrench: [{channel: /foot/wrench}]
  base: {imu: {gyroscope: /imu, accelerometer: /imu}}
"""
_PLANNING = ["optimizer.max_iterations=8", "sequence.motions=3"]


class Samples:
    """Makes a file when it is first asked for, and copies it from then on."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def put(self, name: str, folder: Path) -> None:
        """A file or folder (`name/`) of the repository or made here, into `folder`."""
        name = name.rstrip("/")
        makers: dict[str, Callable[[Path], None]] = {
            "arm.urdf": _urdf,
            "arm.yaml": _config,
            "arm.h5": self._motions,
            "measured.h5": self._measured,
            "measured.csv": self._csv,
            "deg.csv": self._degrees,
            "measured_bag": self._bag,
            "standing.yaml": _standing_config,
            "standing_positions.csv": self._standing_positions,
            "standing_foot.csv": self._standing_foot,
            "standing_bag": self._standing_bag,
            "fit.h5": self._fit,
            "diagnosis.h5": self._diagnosis,
        }
        source = self._made(name, makers[name]) if name in makers else ROOT / name
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, target)

    def _made(self, name: str, make: Callable[[Path], None]) -> Path:
        path = self._folder / name
        if not path.exists():
            make(path)
        return path

    def _case(self) -> Case:
        self._made("arm.urdf", _urdf)
        return load_case(self._made("arm.yaml", _config))

    def _data(self) -> Dataset:
        return load_data(self._case(), self._made("measured.h5", self._measured))

    def _motions(self, path: Path) -> None:
        self._case()
        plan(load_problem(self._folder / "arm.yaml", _PLANNING), output=path)

    def _measured(self, path: Path) -> None:
        motions = read_result(self._made("arm.h5", self._motions))
        settings = SimulationSettings(rate=200.0)
        recording = simulate(self._case(), motions, ["coulomb_friction@elbow=1.5"], settings)
        write_dataset(path, recording.dataset, {})

    def _csv(self, path: Path) -> None:
        _write_csv(path, self._data(), 1.0, 1.0)

    def _degrees(self, path: Path) -> None:
        _write_csv(path, self._data(), 180 / np.pi, 1e3)

    def _bag(self, path: Path) -> None:
        from tests.measurement.bags import States, write_standing

        data = self._data()
        run = data.runs[0]
        write_standing(path, States(data.joint_names, run.t, run.q, run.tau), {})

    def _standing(self) -> Dataset:
        """The arm on one foot, with an inertial unit."""
        self._made("arm.urdf", _urdf)
        case = load_case(self._made("standing.yaml", _standing_config))
        motions = read_result(self._made("arm.h5", self._motions))
        return simulate(case, motions, (), SimulationSettings(rate=100.0), chosen=[1]).dataset

    def _standing_positions(self, path: Path) -> None:
        data = self._standing()
        run = data.runs[0]
        write_table(path, {"t": run.t, **named("q", run.q, data.joint_names)})

    def _standing_foot(self, path: Path) -> None:
        run = self._standing().runs[0]
        both = {"foot_wrench": ("fx", "fy", "fz", "mx", "my", "mz"),
                "imu": ("wx", "wy", "wz", "ax", "ay", "az")}  # fmt: skip
        columns = {"t": run.t}
        for channel, parts in both.items():
            columns |= named(channel, run.extra[channel], parts)
        write_table(path, columns)

    def _standing_bag(self, path: Path) -> None:
        from tests.measurement.bags import IMU, WRENCH, States, Topic, write_standing

        data = self._standing()
        run = data.runs[0]
        topics = {
            "/foot/wrench": Topic(WRENCH, run.t, run.extra["foot_wrench"]),
            "/imu": Topic(IMU, run.t, run.extra["imu"]),
        }
        write_standing(path, States(data.joint_names, run.t, run.q), topics)

    def _fit(self, path: Path) -> None:
        case = self._case()
        save_fit(path, case, identify(case, self._data()))

    def _diagnosis(self, path: Path) -> None:
        diagnose(self._case(), self._data(), output=path)


def _urdf(path: Path) -> None:
    shutil.copy(ROOT / "data" / "smoke_arm.urdf", path)


def _config(path: Path) -> None:
    text = (ROOT / "configs" / "smoke.yaml").read_text(encoding="utf-8")
    path.write_text(text.replace(f"..{os.sep}data{os.sep}smoke_arm.urdf", "arm.urdf"), "utf-8")


def _standing_config(path: Path) -> None:
    _config(path)
    text = path.read_text("utf-8").replace("robot:\n", f"robot:\n{_STANDING}", 1)
    path.write_text(text + _SENSORS, "utf-8")


def _write_csv(path: Path, data: Dataset, angle: float, time: float) -> None:
    run, names = data.runs[0], data.joint_names
    sliding = np.array([name == "slide" for name in names])
    q = run.q * np.where(sliding, 1.0, angle)
    columns = {"t": run.t * time, **named("q", q, names), **named("tau", run.tau, names)}
    write_table(path, columns)
