"""Surroundings that no motion can have end with the reason, exit status 1 and no file."""

import pytest

from tests.cli.program import BRIEF, SMOKE, Program

TABLE = "constraints.surroundings.boxes={table: {size: [0.6, 1.2, 0.1], position: [0.5, 0, 0.7]}}"
AWAY = "constraints.surroundings.boxes={table: {size: [0.6, 1.2, 0.1], position: [0.8, 0, 0.1]}}"
FLOOR = "constraints.surroundings.floor=0.0"
LOAD = (
    "robot.payload={{link: {link}, mass: 1.5, start: [0, 0, 0], end: [{end}, 0, 0], radius: 0.04}}"
)
REFUSED = {
    "start inside the table": (
        [TABLE],
        ["at robot.posture, ", "forearm is 0.0", " m inside table", "constraints.surroundings"],
    ),
    "payload through the floor": (
        [FLOOR, LOAD.format(link="tool", end=1.5)],
        ["at robot.posture, payload is 0.", " m below the floor", "Give another robot.posture"],
    ),
    "start in a region to stay out of": (
        ["constraints.keep_out={cable: {elbow: [0.7, 1.2]}}"],
        ["at robot.posture, ", "region 'cable'", "elbow 0.800 in [0.7, 1.2]"],
    ),
    "no room for any posture": (
        ["constraints.surroundings={floor: 0.3, margin: 0.1}",
         "constraints.surroundings.walls={lid: {point: [0, 0, 0.5], normal: [0, 0, -1]}}",
         "robot.posture={shoulder_pitch: 1.5708, elbow: 0, slide: 0.05}"],
        ["no posture found", "surroundings (", "constraints.surroundings.ignore"],
    ),
}  # fmt: skip
MISTYPED = {
    "obstacle to ignore": (
        [AWAY, "constraints.surroundings.ignore=[[forearm, tabel]]"],
        "no obstacle 'tabel'. Did you mean 'table'",
    ),
    "link of the payload": (
        [LOAD.format(link="tol", end=0.1)],
        "robot.payload.link: the robot has no link 'tol'. Did you mean 'tool'",
    ),
    "joint of a region": (
        ["constraints.keep_out={cable: {elbw: [0.7, 1.2]}}"],
        "constraints.keep_out.cable: the robot has no joint 'elbw'. Did you mean 'elbow'",
    ),
}


def _changes(words: list[str]) -> list[str]:
    return [part for word in words for part in ("--set", word)]


@pytest.mark.parametrize("case", REFUSED)
def test_the_reason_is_told_and_nothing_is_written(excite: Program, case: str) -> None:
    settings, told = REFUSED[case]
    said = excite.refused("optimize", SMOKE, *BRIEF, *_changes(settings), status=1)
    reason = said.partition("error: No admissible motion: ")[2]
    assert all(words in reason for words in told), said
    assert list(excite.folder.iterdir()) == []


@pytest.mark.parametrize("case", MISTYPED)
def test_mistyped_names(excite: Program, case: str) -> None:
    settings, told = MISTYPED[case]
    assert told in excite.refused("optimize", SMOKE, *BRIEF, *_changes(settings))
    assert list(excite.folder.iterdir()) == []


def test_what_is_checked_and_kept_is_shown(excite: Program) -> None:
    settings = _changes(
        [
            AWAY,
            "constraints.surroundings.floor=0.19",
            "constraints.keep_out={cable: {shoulder_yaw: [1, 2], wrist_roll: [1, 2]}}",
            LOAD.format(link="tool", end=0.1),
        ]
    )
    run = excite.good("optimize", SMOKE, *BRIEF, "--motions", "1", "-v", *settings)
    told = " ".join(run.stderr.split())
    assert "surroundings: floor, table; " in told
    assert "payload: 1.5 kg on tool" in told
    assert "not guarded, since no motion parts them: column – floor always in contact" in told
    checked = [line for line in run.stderr.splitlines() if line.startswith("  checked")]
    assert any(line.split() == ["checked", "payload", "–", "table"] for line in checked)
    for word in ("surroundings", "keep_out", "cable"):
        assert word in run.stdout
    check = excite.answer("check", SMOKE, "smoke.h5", *settings)
    margins = check["motions"][0]["margins"]
    assert margins["surroundings"] >= 0
    assert margins["keep_out"] >= 0
    moved = excite("check", SMOKE, "smoke.h5", "--set", TABLE)
    assert moved.returncode == 1  # the motion was made for a table that stood elsewhere
