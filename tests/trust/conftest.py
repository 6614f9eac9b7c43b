import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

from excite_cli import diagnose, identify, load_problem, plan, save_fit, simulate
from excite_cli.measurement.hdf5_writer import write_dataset

SMOKE = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"


Edit = Callable[[h5py.File], None]
# A robot whose description computes its mass, with more before its links.
XACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">{more}<link name="base"/>
<link name="l"><inertial><mass value="{mass}"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="l"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


class Loop:
    """The files of one short loop on the small arm."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.result, self.data = folder / "result.h5", folder / "data.h5"
        self.fit, self.diagnosis = folder / "fit.h5", folder / "diagnosis.h5"


def edited(source: Path, target: Path, edit: Edit) -> Path:
    """A copy in which something was changed."""
    shutil.copy(source, target)
    with h5py.File(target, "r+") as file:
        edit(file)
    return target


def config_with(old: str, new: str) -> Edit:
    """Changes words of the stored config."""

    def edit(file: h5py.File) -> None:
        text = file.attrs["config"]
        assert old in text
        file.attrs["config"] = text.replace(old, new)

    return edit


@pytest.fixture(scope="session")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Loop:
    """Plan, simulate, identify, diagnose: never written to again."""
    made = Loop(tmp_path_factory.mktemp("loop"))
    problem = load_problem(SMOKE, ["optimizer.max_iterations=4", "diagnosis.rounds=2"])
    result = plan(problem, output=made.result)
    data = simulate(problem, result, ["coulomb_friction@elbow=3"]).dataset
    write_dataset(made.data, data, {})
    save_fit(made.fit, problem, identify(problem, data))
    diagnose(problem, data, output=made.diagnosis)
    return made
