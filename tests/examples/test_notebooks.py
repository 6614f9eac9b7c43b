"""The notebooks run from an empty folder, given where the data are, and say what they promise."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.program import ROOT

NOTEBOOKS = ROOT / "examples" / "notebooks"
PATHS = sorted(NOTEBOOKS.glob("*.ipynb"))
# Of each: what its cells print, and the files that it leaves.
EXPECTED = {
    "1-from-a-log-to-names": (
        r"coupled_friction.*joint_5, joint_6",
        {"tx40.h5", "tx40.html", "tx40_found.yaml", "figures"},
    ),
    "2-plan-simulate-diagnose": (
        r"load_dependent_friction on shoulder_pitch: ratio 0\.0(59|60)", {"arm.h5", "diagnosis.h5"},
    ),
    "3-next-motion-and-export": (
        r"spring.*axis_2", {"kr300.h5", "next.h5", "next.csv", "kr300.c", "kr300.xml"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_it_runs(path: Path, tmp_path: Path) -> None:
    environment = {"OPENBLAS_NUM_THREADS": "1", "EXCITE_DATA": str(ROOT / "data")}
    run = subprocess.run(
        [sys.executable, Path(__file__).with_name("run_notebook.py"), path],
        cwd=tmp_path,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert run.returncode == 0, run.stderr
    words, files = EXPECTED[path.stem]
    assert re.search(words, run.stdout)
    assert "<table>" in run.stdout
    assert {each.name for each in tmp_path.iterdir()} == files


def test_notebooks_are_stored_without_outputs() -> None:
    assert [path.stem for path in PATHS] == sorted(EXPECTED)
    for path in PATHS:
        book = json.loads(path.read_text(encoding="utf-8"))
        assert (book["nbformat"], book["metadata"]["kernelspec"]["language"]) == (4, "python")
        code = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
        assert len(code) >= 5
        assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
        assert path.stat().st_size < 20_000
