"""One package with a member of every family, as docs/how-to/own.md writes it, used by commands."""

import json
import os
import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest

from excite_cli import load_case, load_data
from tests.cli.program import BRIEF, EXCITE, SMOKE, Installed, environment

pytest.importorskip("mujoco")
PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "own.md").read_text(encoding="utf-8")
STIFFNESS = 20.0  # N·m/rad³
LIMIT = 4.0  # W
NAMES = ("rubber_spring", "joint_power", "worst_three", "voltage of the supply")


def install(folder: Path) -> None:
    """The six modules of the page, and what an installer leaves of their entry points."""
    for text in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        (folder / re.match(r'"""(\w+\.py):', text)[1]).write_text(text, encoding="utf-8")  # type: ignore[index]
    (declared,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    groups = tomllib.loads(declared)["project"]["entry-points"]
    lines = [
        line
        for group, points in groups.items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in points.items()))
    ]
    info = folder / "my_cell-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-cell\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The program in a folder, in processes that have the package."""
    package = tmp_path_factory.mktemp("package")
    install(package)
    paths = [str(package), str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
        yield Installed(tmp_path_factory.mktemp("cell"), tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="module")
def planned(cell: Installed) -> Any:
    """A motion by the package's criterion, within its constraint."""
    own = ("criterion.kind=worst_three", f"constraints.own.joint_power.limit={LIMIT}")
    settings = [word for each in own for word in ("--set", each)]
    return cell.answer("optimize", SMOKE, "-o", "motions.h5", "--motions", "1", *BRIEF, *settings)


@pytest.fixture(scope="module")
def measured(cell: Installed, planned: Any) -> Path:
    """A recording of a robot with the package's effect, in its kind of file."""
    effect = f"rubber_spring@elbow={STIFFNESS:g}"
    cell.good("simulate", SMOKE, "motions.h5", "-o", "measured.h5", "--effect", effect)
    return written_as_log(cell.folder / "measured.h5", cell.folder / "measured.celllog", 47.5)


def written_as_log(source: Path, to: Path, volts: float) -> Path:
    """The first run of measured data as a log of the cell."""
    run = load_data(load_case(SMOKE), source).runs[0]
    joints, t, q, tau = load_case(SMOKE).robot.joint_names, run.t, run.q, run.tau
    rows = (
        {
            "t": float(t[k]),
            "volts": volts,
            "q": dict(zip(joints, q[k].tolist(), strict=True)),
            "tau": dict(zip(joints, tau[k].tolist(), strict=True)),
        }
        for k in range(len(t))
    )
    to.write_text("".join(f"{json.dumps(row)}\n" for row in rows), encoding="utf-8")
    return to


def offered(cell: Installed, words: str) -> list[str]:
    """What the shell offers after Tab."""
    asked = {"_EXCITE_COMPLETE": "complete_bash", "COMP_WORDS": f"excite {words}"}
    place = {"COMP_CWORD": str(len(words.split()))}
    run = subprocess.run(
        EXCITE, env={**environment(cell.cache), **asked, **place}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    return run.stdout.split("\n")


def test_help_schema_and_completion_have_them(cell: Installed) -> None:
    assert "npz, waypoints of motions" in cell.good("export", "--help").stdout
    assert "log of the cell" in " ".join(cell.good("identify", "--help").stdout.split())
    assert "waypoints" in " ".join(cell.good("check", "--help").stdout.split())
    schema = cell.good("schema").stdout
    assert [name for name in NAMES if f'"{name}"' not in schema] == []
    tree = json.loads(schema)["$defs"]
    assert tree["ConstraintsSpec"]["properties"]["own"]["properties"] == {
        "joint_power": {
            "type": "object", "properties": {"limit": {"type": "number"}}, "required": ["limit"],
        }
    }  # fmt: skip
    assert "waypoints" in offered(cell, "export --format w")
    assert "rubber_spring@" in offered(cell, "simulate --effect rub")
    for start, end in (
        ("criterion.kind=", "worst_three"), ("measurement.trust=", "voltage of the supply"),
        ("constraints.own.", "joint_power"), ("diagnosis.kinds=", "rubber_spring"),
    ):  # fmt: skip
        assert any(each.startswith(start + end) for each in offered(cell, f"check --set {start}"))


def test_a_motion_is_planned_with_its_constraint_and_criterion(planned: Any) -> None:
    (motion,) = planned["motions"]
    assert motion["margins"]["joint_power"]["margin"] >= 0.0
    assert planned["criterion"]["kind"] == "worst_three"


def test_a_motion_is_written_and_checked_in_its_format(cell: Installed, planned: Any) -> None:
    found = cell.answer("export", "motions.h5", "--format", "waypoints", "--motion", "1")
    (written,) = [each["output"] for each in found["motions"]]
    assert written.endswith(".way")
    kept = ("--set", f"constraints.own.joint_power.limit={LIMIT}")
    (checked,) = cell.answer("check", SMOKE, written, *kept)["motions"]
    assert checked["margins"]["joint_power"] >= 0.0


def test_its_effect_is_identified_from_its_kind_of_file(cell: Installed, measured: Path) -> None:
    effects = "effects=[{kind: rubber_spring, joints: [elbow]}]"
    found = cell.answer("identify", SMOKE, measured, "--set", effects)
    (effect,) = found["effects"]
    value = effect["parameters"]["stiffness"]
    assert value["value"] == pytest.approx(STIFFNESS, rel=0.1)


def test_its_check_is_a_row_and_its_fault_is_refused(cell: Installed, measured: Path) -> None:
    rows = {row["name"]: row for row in cell.answer("inspect", SMOKE, measured)["checks"]}
    assert rows["voltage of the supply"]["status"] == "ok"
    sagged = written_as_log(cell.folder / "measured.h5", cell.folder / "sagged.celllog", 41.0)
    run = cell("inspect", SMOKE, sagged, "--json")
    assert run.returncode == 1, run.stderr
    rows = {row["name"]: row for row in json.loads(run.stdout)["checks"]}
    assert rows["voltage of the supply"]["status"] == "fault"
    assert "the supply sagged to 41 V" in cell.refused("identify", SMOKE, sagged)
