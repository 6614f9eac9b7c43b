"""A page begins with the answer: what comes last in a loop is first, and figures lead on."""

import re
from dataclasses import replace
from math import nan
from pathlib import Path

import pytest

from excite_cli.api.reporting import ReportedFile, _robot
from excite_cli.diagnosis.records import OPEN_SETUP, Diagnosis
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.measurement.dataset import Finding
from excite_cli.report.page import render
from excite_cli.report.posture_chart import robot_chart
from excite_cli.robot.tree import skeleton_of
from excite_cli.shown.answer import Page
from excite_cli.summary.assembly import Source, page_of
from excite_cli.summary.error_by_joint import faces_of
from excite_cli.summary.status import diagnosis_figures
from tests.diagnosis.synthetic_diagnosis import make_diagnosis
from tests.report.case import Case
from tests.report.structure import Structure


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    return make_diagnosis()


def _page(*sources: Source) -> Page:
    return page_of(sources, lambda name, done: None)


def test_the_diagnosis_is_before_the_motions_and_alone_on_paper(
    diagnosis: Diagnosis, case: Case
) -> None:
    problem, result = case
    page = _page(Source("m", "m.h5", result, problem, False), Source("d", "d.h5", diagnosis))
    anchors = [section.anchor for section in page.sections]
    assert anchors.index("diagnosis-found") == 0
    assert anchors.index("condition") > anchors.index("diagnosis-data")
    assert [each.name for each in page.figures][:3] == [
        "error on held-out data, moving",
        "effects found",
        "what next",
    ]
    printed = {section.anchor for section in page.sections if section.on_paper}
    assert {"diagnosis-found", "diagnosis-errors"} <= printed
    assert not printed & {"condition", "margins", "diagnosis-candidates", "diagnosis-evidence"}
    alone = _page(Source("m", "m.h5", result, problem, False))
    assert {"condition", "margins"} <= {each.anchor for each in alone.sections if each.on_paper}
    assert alone.answers[0].kind in ("answer", "bad")


def test_two_diagnoses_are_side_by_side_first_and_figures_lead_to_their_own(
    diagnosis: Diagnosis,
) -> None:
    page = _page(Source("one", "one.h5", diagnosis), Source("two", "two.h5", diagnosis))
    anchors = [section.anchor for section in page.sections]
    assert anchors[0] == "compare-diagnoses"
    assert [answer.text.split(":")[0] for answer in page.answers] == ["one", "two"]
    led = [figure.anchor for figure in page.figures]
    assert set(led) <= set(anchors)
    assert len(set(led)) == len(led)
    links = [a["href"] for a in Structure(render(page)).all("a")]
    assert all(f"#{anchor}" in links for anchor in led)


def test_figures_are_coloured_by_verdict(diagnosis: Diagnosis) -> None:
    (named,) = diagnosis.effects
    sure = replace(named, aliases=())
    clean = replace(diagnosis, effects=(sure,), excess_residuals=(), findings=())
    assert [each.verdict for each in diagnosis_figures(clean)] == ["good", "good", "good"]
    doubted = replace(clean, effects=(named,))
    assert [each.verdict for each in diagnosis_figures(doubted)] == ["good", "open", "open"]
    harmful = replace(clean, effects=(replace(sure, verdict=HeldOutVerdict.HARMFUL),))
    assert diagnosis_figures(harmful)[1].verdict == "bad"
    set_up = replace(clean, findings=(Finding(OPEN_SETUP, "warning", "a zero may be off"),))
    following = diagnosis_figures(set_up)[2]
    assert (following.value, following.verdict) == ("resolve the set-up", "bad")
    assert following.anchor == "diagnosis-data"


def test_the_worst_joint_and_the_size_are_on_top(diagnosis: Diagnosis) -> None:
    joints = diagnosis.joint_names
    shares = {**dict.fromkeys(joints, nan), joints[0]: 0.03, joints[1]: 0.07}
    after = replace(diagnosis.after, relative_moving=shares)
    error, effects, _ = diagnosis_figures(replace(diagnosis, after=after))
    assert f"worst joint: {joints[1]} 7.00%" in error.remark
    assert "viscous friction on elbow: 2.00 ± 0.10 N·m·s/rad" in effects.remark


def test_the_robot_of_a_diagnosis_is_drawn_from_its_shapes(
    diagnosis: Diagnosis, tmp_path: Path
) -> None:
    file = ReportedFile(tmp_path / "d.h5", "d", diagnosis)
    robot = _robot(file, None)
    assert robot is not None
    faces = faces_of(robot)
    assert faces is not None
    assert set(faces.joints.tolist()) <= set(range(robot.n + 1))
    shares = dict.fromkeys(robot.joint_names, 0.1) | {robot.joint_names[0]: 0.4}
    skeleton = skeleton_of(robot)
    chart = robot_chart("Robot", skeleton, robot.joint_names, shares, "Error", faces)
    assert chart.svg.count('<path d="M') > 50
    assert ">40.0%</text>" in chart.svg  # the end of the scale
    width, height = map(float, re.findall(r'viewBox="0 0 (\S+) (\S+)"', chart.svg)[0])
    corners = re.findall(r"[ML]([\d.-]+) ([\d.-]+)", chart.svg)
    assert all(0 <= float(x) <= width and 0 <= float(y) <= height for x, y in corners)
    other = replace(file, content=replace(diagnosis, fingerprint="another"))
    assert _robot(other, None) is None
    gone = replace(file, content=replace(diagnosis, config_folder=str(tmp_path)))
    assert _robot(gone, None) is None
