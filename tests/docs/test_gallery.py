"""The gallery: its pages are whole, and say what the diagnosis says."""

import re
from dataclasses import replace

import numpy as np
import pytest

from docs.gallery_page import Diagnosed, as_markdown, escaped, left_of, page
from docs.make_gallery import LARGEST, ROBOTS, TARGET
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.shown.answer import Command, Table
from tests.diagnosis.synthetic_diagnosis import make_diagnosis
from tests.docs.test_links import broken

_PICTURE = re.compile(r"!\[[^\]]+\]\(([^)]+\.png)\)")


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_page_has_all_its_sections_and_small_pictures(robot: str) -> None:
    path = TARGET / f"{robot}.md"
    text = path.read_text(encoding="utf-8")
    headings = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert headings[:5] == ["The log", "What the declared model leaves", "Names",
                            "Before and after", "Unexplained residual"]  # fmt: skip
    pictures = _PICTURE.findall(text)
    assert len(pictures) >= 4
    assert sorted(pictures) == sorted(each.name for each in TARGET.glob(f"{robot}-*.png"))
    for name in pictures:
        assert (TARGET / name).read_bytes().startswith(b"\x89PNG")
        assert (TARGET / name).stat().st_size < LARGEST
    assert broken(path) == []


def test_the_index_leads_to_every_page() -> None:
    text = (TARGET / "index.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\]\((\w+)\.md\)", text)) == set(ROBOTS)
    for robot in ROBOTS:
        table = re.findall(r"^\| mean \|.*\|$", (TARGET / f"{robot}.md").read_text("utf-8"), re.M)
        rows = re.findall(rf"^\| \[.*\]\({robot}\.md\) \| (\d[\d.]*) % \| (\d[\d.]*) %", text, re.M)
        assert len(rows) == len(table) >= 1
        for row, cells in zip(rows, table, strict=True):
            _, before, *_, after = re.findall(r"([\d.]+)%", cells)
            for told, exact in zip(row, (before, after), strict=True):
                assert abs(float(told) - float(exact)) <= (0.5 if "." not in told else 0.05)


def test_what_is_left_is_said_of_every_joint() -> None:
    found = make_diagnosis()
    moving = {**found.after.relative_moving, "elbow": 0.123, "slide": float("nan")}
    left = left_of(replace(found, after=replace(found.after, relative_moving=moving)))
    assert tuple(left) == found.joint_names
    assert left["elbow"].startswith(
        "12.3% of its torque is left where it moves. Residual above noise: "
    )
    assert "Residual above noise: elbow 0.8" in left["elbow"]
    assert left["slide"].startswith("it does not move in the held-out data")
    quiet = next(j for j in found.joint_names if j not in {"elbow", "slide"}
                 and j not in {each.joint for each in found.excess_residuals})  # fmt: skip
    assert left[quiet].endswith("was found in what is left of the training data.")


def test_warnings_and_several_answers_are_told() -> None:
    warned = Finding("lag", "warning", "speeds <lag> by 0.2 s", "run_1")
    found = replace(make_diagnosis(), findings=(warned,))
    t = np.arange(101) / 50.0
    run = Run("run_1", t, np.zeros((101, 5)), np.zeros((101, 5)))
    command = Command(("excite", "diagnose", "a b.yaml"))
    answers = [Diagnosed("a log", command, found, "friction", {"errors": "x-1-errors.png"}),
               Diagnosed("the same, held-out B", command, found, "nothing", {})]  # fmt: skip
    data = Dataset(found.joint_names, (run,))
    text = page({"robot": "An arm", "licence": "MIT", "units": "SI"}, data, answers)
    assert "# An arm" in text
    assert "- licence: MIT\n" in text
    assert "units" not in text
    assert "| run_1 | 101 | 2 | 50 | held out |" in text
    assert "- warning: speeds &lt;lag&gt; by 0.2 s\n" in text
    assert "$ excite diagnose 'a b.yaml'" in text
    assert "](x-1-errors.png)" in text
    assert "\n## The same, held-out B\n" in text


def test_cells_cannot_break_a_table() -> None:
    table = Table("T", ("a", "b"), (("x|y", "1\n2"), ("[z]", "*")), left=("a",))
    assert as_markdown(table) == (
        "T:\n\n| a | b |\n| :-- | --: |\n| x\\|y | 1<br>2 |\n| \\[z\\] | \\* |"
    )
    assert escaped("a <b> & `c`") == "a &lt;b&gt; &amp; \\`c\\`"
