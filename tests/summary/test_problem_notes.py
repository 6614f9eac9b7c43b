"""What is said of a problem before work begins."""

from pathlib import Path

from excite_cli.config.load_spec import parse_spec
from excite_cli.excitation.problem import build_problem
from excite_cli.shown.note import Level
from excite_cli.summary.problem_notes import problem_notes
from tests.proposal.robots import GOOD, joint, link, serial


def warnings(folder: Path, joints: str) -> list[str]:
    serial(
        folder,
        "base shoulder upper crank rod",
        joint("knee", "upper", "shin", GOOD),
        link("shin"),
        '<loop_joint name="loop"><link1 link="rod"/><link2 link="shin"/></loop_joint>',
    )
    spec = parse_spec(f"robot: {{urdf: robot.urdf, joints: [{joints}]}}")
    notes = problem_notes(build_problem(spec, folder))
    return [note.text for note in notes if note.level is Level.WARNING]


def test_moved_joints_of_a_loop_that_is_cut_are_a_warning(tmp_path: Path) -> None:
    (told,) = warnings(tmp_path, "shoulder, crank")
    assert told.startswith("a closed loop is cut between rod and shin: in the model, crank, knee ")
    assert warnings(tmp_path, "shoulder") == []
