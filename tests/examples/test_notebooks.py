"""The notebooks run from an empty folder, given where the data are, and say what they promise."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.cli.program import ROOT

NOTEBOOKS = ROOT / "examples" / "notebooks"
PATHS = sorted(NOTEBOOKS.glob("*.ipynb"))
# Of each: what its cells print, and the files that it leaves.
EXPECTED = {
    "1-from-a-log-to-names": (
        r"friction of coupled gears.*joint_5, joint_6",
        {"tx40.h5", "tx40.html", "tx40_found.yaml", "figures"},
    ),
    "2-plan-simulate-diagnose": (
        r"load-dependent friction on shoulder_pitch: ratio 0\.0(59|60)", {"arm.h5", "diagnosis.h5"},
    ),
    "3-next-motion-and-export": (
        r"spring.*axis_2", {"kr300.h5", "next.h5", "next.csv", "kr300.c", "kr300.xml"},
    ),
    "4-arrays-in-frames-out": (r"pin\.rnea leaves out: viscous_friction.*axis_6", {"kr300.h5"}),
}  # fmt: skip


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_it_runs(path: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    environment = {"OPENBLAS_NUM_THREADS": "1", "EXCITE_DATA": str(ROOT / "data")}
    to = tmp_path_factory.mktemp("executed") / path.name
    run = subprocess.run(
        [sys.executable, Path(__file__).with_name("run_notebook.py"), path, to],
        cwd=tmp_path,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert run.returncode == 0, run.stderr
    words, files = EXPECTED[path.stem]
    told = "".join(map(text_of, outputs_of(to)))
    assert re.search(words, told)
    assert "<table" in told
    assert {each.name for each in tmp_path.iterdir()} == files
    assert [kind_of(each) for each in outputs_of(path)] == [kind_of(x) for x in outputs_of(to)]


def outputs_of(path: Path) -> list[dict[str, Any]]:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [each for cell in cells for each in cell.get("outputs", ())]


def text_of(output: dict[str, Any]) -> str:
    texts = [x for kind, x in output.get("data", {}).items() if kind.startswith("text/")]
    return "".join(line for text in (output.get("text", ()), *texts) for line in text)


def kind_of(output: dict[str, Any]) -> tuple[str, ...]:
    return output["output_type"], output.get("name", ""), *output.get("data", {})


def test_notebooks_are_stored_with_outputs() -> None:
    """As they were run: `python -m tests.examples.run_notebook NOTEBOOK` stores them."""
    assert [path.stem for path in PATHS] == sorted(EXPECTED)
    for path in PATHS:
        book = json.loads(path.read_text(encoding="utf-8"))
        assert (book["nbformat"], book["metadata"]["kernelspec"]["language"]) == (4, "python")
        code = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
        assert len(code) >= 5
        assert [cell["execution_count"] for cell in code] == [*range(1, len(code) + 1)]
        assert sum(bool(cell["outputs"]) for cell in code) >= 4
        assert "error" not in {each["output_type"] for each in outputs_of(path)}
        assert not re.search("/(tmp|home|root|work)/", path.read_text(encoding="utf-8"))
        assert path.stat().st_size < 150_000
