"""No key of the configuration is documented and does nothing."""

from pathlib import Path

import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.spec import Spec
from excite_cli.constraints.catalogue import CONSTRAINTS

from .section_reads import Reads, sections_of

PACKAGE = Path(__file__).parents[2] / "excite_cli"
# They say which section is meant, and are gone once it is known.
TAGS = {("FourierSpec", "family"), ("BSplineSpec", "family"), ("DiscSpec", "kind"),
        ("PolygonSpec", "kind")}  # fmt: skip


def test_every_key_is_read() -> None:
    known = sections_of(Spec)
    assert len(known) > 25
    keys = {(name, key) for name, section in known.items() for key in section.model_fields}
    by_table = {("ConstraintsSpec", key) for key in CONSTRAINTS.members}
    unread = keys - Reads(PACKAGE, known).found - by_table - TAGS
    assert not unread, f"documented, and nothing reads them: {sorted(unread)}"


SOURCE = """
class Problem:
    spec: MeasurementSpec

def direct(spec: FilterSpec, other: Problem) -> float:
    return spec.border + other.parallel

def through(problem: Problem) -> None:
    for each in [problem.spec.filter]:
        print({})
"""


@pytest.mark.parametrize(
    ("line", "idle"),
    [("1", True), ("each.parallel", False), ("problem.parallel", True),
     ("(each or None).parallel", False)],
)  # fmt: skip
def test_a_key_that_nothing_reads_is_found(tmp_path: Path, line: str, idle: bool) -> None:
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "work.py").write_text(SOURCE.format(line))
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "check.py").write_text("def check(s: FilterSpec): return s.velocity")
    found = Reads(tmp_path, sections_of(MeasurementSpec)).found
    assert ("FilterSpec", "border") in found
    assert ("MeasurementSpec", "filter") in found
    assert ("FilterSpec", "velocity") not in found
    assert (("FilterSpec", "parallel") not in found) is idle
