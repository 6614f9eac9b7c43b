"""Examples of arrays, tables, plots and engines in the page on the library run as they stand."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from tests.cli.program import ROOT
from tests.docs.samples import Samples


def test_examples_run(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    samples = Samples(tmp_path_factory.mktemp("made"))
    for name in ("configs/smoke.yaml", "data/smoke_arm.urdf", "arm.h5", "arm.urdf", "diagnosis.h5"):
        samples.put(name, tmp_path)
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    own = re.findall(
        r"```python\n(.*?)```", page[page.index("Recordings may be arrays") :], re.DOTALL
    )
    names: dict[str, object] = {}
    for each in own:
        exec(compile(each, "docs/library.md", "exec"), names)
    plt.close("all")
    assert len(own) == 3
    assert names["same"].joint_names == names["data"].joint_names  # type: ignore[attr-defined]
