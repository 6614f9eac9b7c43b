"""A result that was edited, or is of an earlier version: nothing of it counts as proved."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli import check, load_case, load_problem, plan, read_result, write_result
from excite_cli.api.campaigning import CampaignOptions, Measure, run_campaign
from excite_cli.api.comparing import optimized_for
from excite_cli.campaign.measure import NotMeasuredError, Take
from excite_cli.errors import FileError
from excite_cli.excitation.motion import Doubt
from excite_cli.shown.note import Note
from tests.trust.conftest import SMOKE, Edit, Loop, config_with, edited
from tests.trust.in_process import done, excite, refused

CHANGED = "not proved: changed since it was proved"
EARLIER = "not proved: written by an earlier version"
BRIEF = ("--motions", "1", "--set", "optimizer.max_iterations=1", "-q")
FIRST = "motions/1"


def _scaled(file: Any, factor: float = 1.6) -> None:
    """The motion and its samples, which go on to agree."""
    for name in ("coefficients", "q", "v", "a"):
        file[f"{FIRST}/{name}"][...] = factor * file[f"{FIRST}/{name}"][()]


def _record(name: str, change: Callable[[Any], Any]) -> Edit:
    def edit(file: Any) -> None:
        attributes = file[FIRST].attrs
        attributes[name] = json.dumps(change(json.loads(attributes[name])))

    return edit


def _attribute(name: str, value: Any) -> Edit:
    def edit(file: Any) -> None:
        assert name in file[FIRST].attrs
        file[FIRST].attrs[name] = value

    return edit


def _wider(margins: dict[str, Any]) -> dict[str, Any]:
    return {name: {**worst, "margin": worst["margin"] + 1.0} for name, worst in margins.items()}


def _swapped(file: Any) -> None:
    file.move("motions/1", "motions/x")
    file.move("motions/2", "motions/1")
    file.move("motions/x", "motions/2")


def _one_sample(file: Any) -> None:
    file[f"{FIRST}/q"][3, 2] += 1e-9


def _without(file: Any) -> None:
    del file[FIRST].attrs["digest"]


EDITS: dict[str, Edit] = {
    "the motion, a little": lambda file: _scaled(file, 1.0 + 1e-9),
    "one sample, below what export compares": _one_sample,
    "the verdicts": _record("certified", lambda all_: dict.fromkeys(all_, True) | {"more": True}),
    "a verdict left out": _record("certified", lambda all_: dict(list(all_.items())[1:])),
    "the margins": _record("margins", _wider),
    "the condition number": _attribute("stacked_condition_number", 2.0),
    "the dense condition number": _attribute("dense_condition_number", 2.0),
    "how the search ended": _attribute("status", "converged"),
    "the note": _attribute("note", "all is well"),
    "the limits of the config": config_with("acceleration: 10.0", "acceleration: 40.0"),
    "the posture of the config": config_with("elbow: 0.8", "elbow: 0.9"),
    "another motion in its place": _swapped,
    "the digest": _attribute("digest", "0" * 64),
    "an empty digest": _attribute("digest", ""),
    "no digest": _without,
}
OF_EARLIER = ("an empty digest", "no digest")


@pytest.fixture
def edit(loop: Loop, tmp_path: Path) -> Callable[[Edit], Path]:
    """The loop's result with a change."""
    return lambda change: edited(loop.result, tmp_path / "r.h5", change)


Editing = Callable[[Edit], Path]
A_LITTLE = "the motion, a little"
# For --resume: the same config in all that a verdict speaks of.
GO_ON = ("--set", "optimizer.max_iterations=4", "--set", "diagnosis.rounds=2", "--motions", "3")


def test_a_motion_as_it_was_proved_is_not_doubted(loop: Loop, tmp_path: Path) -> None:
    result = read_result(loop.result)
    assert not result.doubted()
    assert all(all(motion.certified.values()) for motion in result.motions)
    to = tmp_path / "m.csv"
    exported = json.loads(done("export", loop.result, "-f", "csv", "-o", to, "--json").stdout)
    assert [each["doubt"] for each in exported["motions"]] == [None, None]


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_motion_is_not_proved(edit: Editing, tmp_path: Path, name: str) -> None:
    file = edit(EDITS[name])
    words = EARLIER if name in OF_EARLIER else CHANGED
    motion = read_result(file).motions[0]
    assert motion.doubt is (Doubt.EARLIER if name in OF_EARLIER else Doubt.CHANGED)
    assert not any(motion.certified.values())
    assert words in repr(motion)
    told = refused("export", file, "-f", "csv", "-o", tmp_path / "m.csv")
    assert re.search(r"motions? 1\b.* not proved: ", told)
    for part in (motion.doubt, "excite check CONFIG", "--allow-unproved"):
        assert part in told
    assert not list(tmp_path.glob("*.csv"))


@pytest.mark.parametrize("name", [A_LITTLE, "the verdicts", "no digest"])
def test_it_is_written_where_that_is_asked_for(edit: Editing, tmp_path: Path, name: str) -> None:
    export = ("export", edit(EDITS[name]), "-f", "csv", "-o", tmp_path / "m.csv", "--motion")
    run = done(*export, "1", "--allow-unproved", "--json")
    assert "not proved" in run.stderr
    doubt = Doubt.EARLIER if name == "no digest" else Doubt.CHANGED
    assert json.loads(run.stdout)["motions"][0]["doubt"] == doubt
    done(*export, "2", "--overwrite")


@pytest.mark.parametrize("factor", [1.6, 0.9])
def test_a_report_says_what_became_of_it(edit: Editing, tmp_path: Path, factor: float) -> None:
    file, page = edit(lambda file: _scaled(file, factor)), tmp_path / "page.html"
    run = done("report", file, "--no-picture", "-o", page, "--json")
    assert json.loads(run.stdout)["doubts"] == [f"{file}: motion 1 is {CHANGED}"]
    text = page.read_text(encoding="utf-8")
    assert f"motion 1 is {CHANGED}" in text
    assert "all proved" not in text
    assert "is proved to hold at every instant" not in text
    assert ("BROKEN" in text) == (factor > 1.0)


def test_check_says_that_the_verdict_of_the_file_does_not_count(loop: Loop, edit: Editing) -> None:
    file = edit(lambda file: _scaled(file, 0.9))
    first, second = json.loads(done("check", SMOKE, file, "--no-meshes", "--json").stdout)[
        "motions"
    ]
    assert (first["doubt"], second["doubt"]) == (Doubt.CHANGED, None)
    said = done("check", SMOKE, file, "--no-meshes").stdout
    assert "motion_1: changed since it was proved: what its file says of it does not" in said
    assert "--start" in said
    with h5py.File(file) as read, h5py.File(loop.result) as before:  # it was not renewed
        assert read[FIRST].attrs["digest"] == before[FIRST].attrs["digest"]


def test_check_says_that_its_config_is_another(loop: Loop) -> None:
    run = excite("check", SMOKE, loop.result, "--no-meshes", "--set", "constraints.torque.scale=1")
    said = " ".join(run.stderr.split())
    assert "planned with another config (different: constraints)" in said
    assert "another config" not in excite("check", SMOKE, loop.result, "--no-meshes").stderr


def test_what_is_shown_and_played_in_simulation_says_so(edit: Editing, tmp_path: Path) -> None:
    file = edit(EDITS[A_LITTLE])
    for words in (
        ("simulate", SMOKE, file, "-o", tmp_path / "d.h5", "--rate", "50"),
        ("view", file, "--png", tmp_path / "v.png", "--size", "64x64", "--time", "0"),
    ):
        assert f"motion 1 is {CHANGED}" in done(*words).stderr


def test_no_plan_goes_on_from_it(edit: Editing, tmp_path: Path) -> None:
    file = edit(EDITS[A_LITTLE])
    before = file.read_bytes()
    told = refused("optimize", SMOKE, "-o", file, "--resume", *GO_ON, "-q")
    assert f"motion 1 of {file} is {CHANGED}" in told
    assert file.read_bytes() == before
    run = done("optimize", SMOKE, "--prior", file, "-o", tmp_path / "new.h5", *BRIEF[:-1])
    assert f"motion 1 is {CHANGED}" in run.stderr
    with pytest.raises(FileError, match="its condition numbers are not its own"):
        optimized_for(load_problem(SMOKE), file)


def test_what_an_earlier_version_wrote_is_gone_on_with(edit: Editing) -> None:
    """Its motions stay without proof; the new ones have theirs."""
    file = edit(_without)
    run = done("optimize", SMOKE, "-o", file, "--resume", *GO_ON, "--json")
    assert f"motion 1 is {EARLIER}" in run.stderr
    doubts = [each["doubt"] for each in json.loads(run.stdout)["motions"]]
    assert doubts == [Doubt.EARLIER, None, None]
    assert [each.doubt for each in read_result(file).motions] == [Doubt.EARLIER, "", ""]


def test_a_start_makes_a_proved_motion_of_it(edit: Editing, tmp_path: Path) -> None:
    file, to = edit(lambda file: _scaled(file, 0.9)), tmp_path / "new.h5"
    done("optimize", SMOKE, "--start", file, "-o", to, *BRIEF)
    assert not read_result(to).doubted()
    done("export", to, "-f", "csv", "-o", tmp_path / "m.csv")


def test_resumed_with_another_optimizer_it_is_still_proved(edit: Editing) -> None:
    """The stored config changes then, in what no verdict speaks of."""
    file = edit(lambda file: None)
    another = ("--set", "optimizer.max_iterations=5")
    done("optimize", SMOKE, "-o", file, "--resume", *GO_ON, *another, "-q")
    found = read_result(file)
    assert len(found.motions) == 3
    assert not found.doubted()


def test_a_result_that_a_script_changed_is_not_proved(loop: Loop, tmp_path: Path) -> None:
    problem = load_problem(SMOKE, ["optimizer.max_iterations=4", "diagnosis.rounds=2"])
    result = read_result(loop.result)
    first, second = result.motions
    faster = replace(first, coefficients=1.6 * first.coefficients)
    changed = replace(result, motions=(faster, second))
    assert [each.doubt for each in changed.doubted()] == [Doubt.CHANGED]
    found = check(problem, changed, meshes=False)
    assert found.doubt("motion_1") is Doubt.CHANGED
    assert not found.doubt("motion_2")
    write_result(tmp_path / "changed.h5", changed, problem)
    read = read_result(tmp_path / "changed.h5")
    assert [each.doubt for each in read.motions] == [Doubt.CHANGED, ""]


def test_a_robot_that_is_another_by_now(tmp_path: Path) -> None:
    urdf = tmp_path / "smoke_arm.urdf"
    text = (SMOKE.parents[1] / "data" / urdf.name).read_text()
    urdf.write_text(text)
    config = tmp_path / "arm.yaml"
    config.write_text(re.sub("urdf: .*", f"urdf: {urdf.name}", SMOKE.read_text()))
    file = tmp_path / "arm.h5"
    plan(load_problem(config, ["optimizer.max_iterations=2", "sequence.motions=1"]), output=file)
    urdf.write_text(text.replace('upper="', 'upper="0', 1))
    export = ("export", file, "-f", "csv", "-o", tmp_path / "m.csv")
    assert Doubt.OTHER_ROBOT in refused(*export)
    done(*export, "--allow-unproved")
    urdf.unlink()  # nothing is known of it then, as on another machine
    done(*export, "--overwrite")


class _Absent(Measure):
    """Notes what it is to play, and measures nothing."""

    suffix = ".csv"

    def __init__(self) -> None:
        self.played: list[str] = []

    def take(self, take: Take) -> None:
        self.played.append(take.name)
        raise NotMeasuredError("the robot is off.")


@pytest.mark.parametrize("name", [A_LITTLE, "the margins", "no digest"])
def test_a_campaign_plays_nothing_that_was_changed(tmp_path: Path, name: str) -> None:
    changes = ["optimizer.max_iterations=2", "optimizer.restarts=1"]
    case, measure, asked = load_case(SMOKE, changes), _Absent(), CampaignOptions(entry=False)
    heard: list[Note] = []
    folder = tmp_path / "campaign"
    with pytest.raises(NotMeasuredError):
        run_campaign(case, measure, folder, asked, retries=0, tell=heard.append)
    assert measure.played == ["round_1_motion_1"]
    plan_ = folder / "round_1.h5"
    edited(plan_, tmp_path / "edited.h5", EDITS[name])
    shutil.copy(tmp_path / "edited.h5", plan_)
    with pytest.raises(FileError, match=r"motion 1 is not proved: .*A campaign plays no such"):
        run_campaign(case, measure, folder, asked, retries=0, resume=True, tell=heard.append)
    assert measure.played == ["round_1_motion_1"]


def test_the_digest_is_the_same_wherever_it_is_taken(loop: Loop) -> None:
    """Seconds differ from run to run, and whole numbers become others in a file."""
    result = read_result(loop.result)
    motion = result.motions[0]
    again = replace(
        motion,
        seconds=motion.seconds + 1.0,
        iterations=motion.iterations + 1,
        coefficients=np.asfortranarray(motion.coefficients),
        margins={n: replace(w, violations=int(w.violations)) for n, w in motion.margins.items()},
    )
    assert result.digest_of(again) == motion.digest
    assert result.digest_of(replace(motion, index=2)) != motion.digest
