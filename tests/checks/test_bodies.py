"""Links that cannot be bodies."""

from pathlib import Path

import pytest

from excite_cli.api.loading import load_case
from excite_cli.checks.bodies import bodies_in_words, impossible_bodies
from tests.urdf_elements import joint, link, robot_text


@pytest.mark.parametrize(
    ("mass", "moments", "status", "words"),
    [
        (2.0, (0.02, 0.02, 0.01), "", ""),
        (2.0, (-0.02, 0.03, 0.03), "fault", "none may be negative"),
        (2.0, (0.01, 0.01, 0.05), "doubt", "any two must add up to the third"),
        (2.0, (20.0, 20.0, 10.0), "doubt", "a body 6.3 m wide"),
        (0.0, (0.02, 0.02, 0.01), "doubt", "its mass is 0"),
        (0.001, (1e-8, 1e-8, -1e-9), "", ""),  # of a sensor: no torque shows it
    ],
)
def test_moments_of_inertia(
    tmp_path: Path, mass: float, moments: tuple[float, ...], status: str, words: str
) -> None:
    xx, yy, zz = moments
    urdf = tmp_path / "one.urdf"
    parts = '<link name="w"/>', link("arm", mass, f"{xx} {yy} {zz}"), joint("j", ("w", "arm"))
    urdf.write_text(robot_text("one", *parts), encoding="utf-8")
    robot = load_case({"robot": {"urdf": str(urdf)}}).robot
    found = impossible_bodies(robot)
    assert [each.status for each in found] == ([status] if status else [])
    assert words in bodies_in_words(robot)
    assert ("arm" in bodies_in_words(robot)) == bool(status)
