"""What a page says of a diagnosis: verdict, errors, evidence, the rest, and what is left."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import (
    Approximation,
    ConfoundedCandidate,
    Diagnosis,
    EffectRecord,
    ExcessResidual,
    JointAlias,
    NamedEffect,
)
from excite_cli.diagnosis.words import approximation_in_words, covariate_in_words
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Value
from excite_cli.measurement.dataset import Finding
from excite_cli.report.chart import Chart
from excite_cli.report.effect_chart import Cloud, law_line
from excite_cli.report.page import render
from excite_cli.report.plot import Plot
from excite_cli.report.residual_chart import noise_by_joint, residuals_in_time
from excite_cli.robot.model import Robot, build_robot
from excite_cli.shown.answer import (
    Block,
    Charts,
    Choice,
    Detail,
    Fold,
    Page,
    Section,
    Table,
    Text,
    parts_of,
)
from excite_cli.summary.assembly import Source, page_of
from excite_cli.summary.diagnosis import (
    diagnosis_parts,
    diagnosis_sections,
)
from excite_cli.summary.error_by_joint import REPEATABILITY
from excite_cli.summary.named_effects import body_parts
from excite_cli.summary.status import diagnosis_figures
from tests.diagnosis.synthetic_diagnosis import make_diagnosis, make_traces
from tests.report.structure import Structure


@pytest.fixture(scope="module")
def plain() -> Diagnosis:
    """Without torque over time."""
    return make_diagnosis()


@pytest.fixture(scope="module")
def diagnosis(plain: Diagnosis) -> Diagnosis:
    traces, held_out = make_traces(plain.joint_names)
    traces = replace(traces, runs=traces.runs[:1])
    rest = replace(plain.excess_residuals[0], depends_on=(Covariate("position", "elbow", True),))
    return replace(plain, traces=traces, held_out_traces=held_out, excess_residuals=(rest,))


@pytest.fixture(scope="module")
def every(diagnosis: Diagnosis) -> tuple[Section, ...]:
    return tuple(diagnosis_sections(diagnosis))


@pytest.fixture(scope="module")
def sections(every: tuple[Section, ...]) -> dict[str, Section]:
    return {each.anchor: each for each in every}


def blocks_of(blocks: tuple[Block, ...]) -> Iterator[Block]:
    """All blocks, those within others too."""
    for block in blocks:
        yield block
        if isinstance(block, Charts):
            yield from block.charts
        elif isinstance(block, Fold):
            yield from blocks_of(block.blocks)
        elif isinstance(block, Choice):
            for _, inner in block.options:
                yield from blocks_of(inner)


def section_of(found: Diagnosis, topic: str, robot: Robot | None = None) -> Section:
    """One section of its page."""
    sections = diagnosis_sections(found, robot=robot)
    return {each.anchor: each for each in sections}[f"diagnosis-{topic}"]


def charts_of(section: Section) -> list[Chart | Plot]:
    return [block for block in blocks_of(section.blocks) if isinstance(block, Chart | Plot)]


def drawn(chart: Chart | Plot) -> str:
    """All words in the drawing."""
    if isinstance(chart, Chart):
        return chart.svg.replace("[CDATA[", "")
    labels = [series.label for panel in chart.panels for series in panel.series]
    return "\n".join([chart.axis, *(panel.axis for panel in chart.panels), *labels])


def silent(name: str, done: int) -> None:
    """What shows no progress."""


def small(diagnosis: Diagnosis, part: float) -> Diagnosis:
    """With two more effects that take this part of the fall off the error of every joint."""
    spring = EffectRecord("spring", ("elbow",), {}, (1.0, 0.0))
    value = {"stiffness": Value(1.0, 0.1, "N·m/rad")}
    parts = dict.fromkeys(diagnosis.joint_names, part * 0.4)
    more = NamedEffect(spring, value, 1e-5, 0.01, 0.3, parts=parts)
    before, after = (
        replace(each, mean_relative_moving=mean)
        for each, mean in ((diagnosis.before, 0.5), (diagnosis.after, 0.1))
    )
    effects = (*diagnosis.effects, more, more)
    return replace(diagnosis, effects=effects, before=before, after=after)


def test_all_parts_are_there_and_the_page_is_sound(
    diagnosis: Diagnosis, every: tuple[Section, ...]
) -> None:
    page = Page("d", "", diagnosis_figures(diagnosis), every)
    structure = Structure(render(page))
    assert [each.anchor for each in page.sections] == [
        "diagnosis-found", "diagnosis-errors", "diagnosis-time", "diagnosis-evidence",
        "validity",
        "diagnosis-unexplained", "diagnosis-next", "diagnosis-candidates", "diagnosis-data",
    ]  # fmt: skip
    for words in (
        "Viscous friction on elbow is indistinguishable from: nonlinear viscous friction on elbow",
        "time stamps jitter by 3 %",
    ):
        assert words in structure.text


def test_every_chart_says_its_finding_in_figures_and_labels_its_axes(
    sections: dict[str, Section],
) -> None:
    charts = [chart for section in sections.values() for chart in charts_of(section)]
    assert len(charts) > 5
    for chart in charts:
        assert re.search(r"\d", chart.alternative), chart.title
        if "explains [%]" not in chart.title:  # the map has joints and quantities
            assert re.search(r"\[[^\]]+\]", drawn(chart)), chart.title


def test_evidence_shows_the_law_and_its_figures(sections: dict[str, Section]) -> None:
    (chart,) = charts_of(sections["diagnosis-evidence"])
    assert chart.title == "viscous friction: elbow"
    assert "2.00 ± 0.10 N·m·s/rad" in chart.caption
    assert "is indistinguishable from: nonlinear viscous friction on elbow" in chart.caption
    assert "99.8%" in chart.alternative or "99.9%" in chart.alternative
    assert drawn(chart).startswith("speed [rad/s]")


@pytest.mark.parametrize(
    ("beside", "told"),
    [
        (
            (),
            "Viscous friction on elbow is indistinguishable from: inertia of the motor (armature) "
            "on elbow.",
        ),
        (
            ("spring",),
            "Viscous friction on elbow + spring at the joint on elbow are indistinguishable from: ",
        ),
    ],
)
def test_evidence_tells_of_pairs(diagnosis: Diagnosis, beside: tuple[str, ...], told: str) -> None:
    """In the words of the table."""
    own, other = diagnosis.effects[0].effect, EffectRecord("armature", ("elbow",))
    named = (own, *(EffectRecord(kind, ("elbow",)) for kind in beside))
    found = replace(diagnosis, joint_aliases=(JointAlias(named, (other,)),))
    elsewhere = replace(found, joint_aliases=(JointAlias((other,), (own,)),))
    captions = [
        charts_of(section_of(each, "evidence"))[0].caption for each in (found, elsewhere, diagnosis)
    ]
    assert told in captions[0]
    assert captions[1] == captions[2]


def test_residuals_tell_held_out_from_training(
    sections: dict[str, Section], diagnosis: Diagnosis
) -> None:
    (choice,) = sections["diagnosis-time"].blocks
    assert isinstance(choice, Choice)
    labels = [label for label, _ in choice.options]
    assert labels == ["run_3 (held out: took no part in the fit)", "run_1"]
    elbow = next(c for c in charts_of(sections["diagnosis-time"]) if c.title == "elbow")
    assert "the declared model without the effects found" in elbow.alternative
    assert isinstance(elbow, Plot)
    upper, lower = elbow.panels
    assert [(each.label, each.look) for each in upper.series] == [
        ("measured", "band"),  # behind
        ("model", "line"),
    ]
    measured, model = (each.y for each in upper.series)
    left, spread = np.sqrt(np.nanmean((measured - model) ** 2)), np.nanstd(measured)
    assert upper.corner == f"fit {100 * (1 - left / spread):.3g} %"
    assert lower.noise == pytest.approx(2.0 * noise_by_joint(diagnosis)["elbow"])


def test_the_noise_is_a_band_of_the_residual(diagnosis: Diagnosis) -> None:
    joints = diagnosis.joint_names
    levels = [0.25] * len(joints)
    known = replace(diagnosis, processing={**diagnosis.processing, "noise_rms": levels})
    chart = charts_of(section_of(known, "time"))[0]
    assert isinstance(chart, Plot)
    shown = chart.panels[1].noise
    assert shown == pytest.approx(0.5 if chart.panels[1].axis == "residual [N·m]" else 500.0)
    assert noise_by_joint(replace(known, excess_residuals=())) == dict.fromkeys(joints, 0.25)
    told = ExcessResidual(joints[1], 1.0, 0.1, 0.02, "band", True, 0.0, ())
    floor = replace(known, noise_floor=dict.fromkeys(joints, 1.0), excess_residuals=(told,))
    assert noise_by_joint(floor) == dict.fromkeys(joints, 1.0) | {joints[1]: 0.02}


def test_held_out_blocks_of_a_run_are_shaded(diagnosis: Diagnosis) -> None:
    traces, (held_out,) = make_traces(diagnosis.joint_names)
    first = replace(traces.runs[0], run="only")
    later = replace(held_out, run="only", t=held_out.t + 6.5)
    (cards,) = residuals_in_time((later, first), diagnosis.joint_names[:2], ("N·m", "N"))
    assert isinstance(cards, Charts)
    assert len(cards.charts) == 2
    for chart in cards.charts:
        assert isinstance(chart, Plot)
        assert chart.shaded == ((later.t[0], later.t[-1]),)
        between = len(first.t)  # no line from one part to the next
        assert np.isnan(chart.panels[0].series[1].y).nonzero()[0].tolist() == [between]
        assert first.t[-1] < chart.x[between] < later.t[0]
        assert (np.diff(chart.x) > 0).all()
    assert isinstance(chart, Plot)
    assert chart.panels[0].axis == "force [N]"


def test_what_depends_is_told_drawn_and_mapped(sections: dict[str, Section]) -> None:
    section = sections["diagnosis-unexplained"]
    told = [b.text for b in section.blocks if isinstance(b, Text)]
    assert any("60% of its variance is predictable, best from history of q[" in x for x in told)
    (picture,) = charts_of(section)
    assert "mean forwards" in drawn(picture)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    names = [row[0] for row in table.rows]
    assert "history of own angle" in names
    assert "time" not in names  # explains nothing
    assert "30" in table.rows[0]  # the most first
    page = render(Page("d", "", (), (section,)))
    assert "var(--blue) 24%, transparent)" in page  # 60 % of 0.3, and a little


def test_without_dependences_there_is_no_map(diagnosis: Diagnosis) -> None:
    assert diagnosis.traces is not None
    dependence = replace(
        diagnosis.traces.dependence, shares=np.zeros_like(diagnosis.traces.dependence.shares)
    )
    calm = replace(
        diagnosis,
        excess_residuals=(),
        traces=replace(diagnosis.traces, dependence=dependence),
    )
    section = section_of(calm, "unexplained")
    assert charts_of(section) == []
    texts = str(section.blocks)
    assert "behaves like noise" in texts
    assert "No smooth function" in texts


@pytest.mark.parametrize(("part", "folded"), [(0.009, True), (-0.009, True), (0.011, False)])
def test_effects_that_carry_less_than_a_hundredth_of_the_fall_are_folded(
    diagnosis: Diagnosis, part: float, folded: bool
) -> None:
    found = section_of(small(diagnosis, part), "found")
    tables = [block for block in found.blocks if isinstance(block, Table)]
    spring = next(t for t in tables if any(row[0] == "spring at the joint" for row in t.rows))
    assert spring.folded == folded


def test_verdicts_on_held_out_data_stand_on_the_card(sections: dict[str, Section]) -> None:
    (chart,) = charts_of(sections["diagnosis-evidence"])
    assert "Held-out, without it: confirmed, +6.00 pp." in chart.caption


def test_the_page_has_every_table_and_sentence_of_the_terminal(diagnosis: Diagnosis) -> None:
    """All that a verbose answer says, but how the data were processed, which is a table there."""
    (named, *_) = diagnosis.effects
    absorbed = (ConfoundedCandidate("wrench_gain", ("elbow",), ("m[elbow]",), 0.0),)
    found = replace(diagnosis, effects=(replace(named, aliases=()), named), absorbed=absorbed)
    processing = {"samples": 10, "rate": 20.0, "candidates": 3, "inflation": 1.0}
    told = diagnosis_parts(replace(found, processing=processing), Detail.VERBOSE)
    (answer, processed, *parts) = told
    page = parts_of(diagnosis_sections(found))
    assert "10 training samples" in str(processed)
    assert any(isinstance(part, Table) for part in parts)
    for part in parts:
        assert part in page, part
    assert page_of([Source("d", "d.h5", found)], silent).answers[0].text == answer


def test_warnings_are_counted_on_top(diagnosis: Diagnosis) -> None:
    said = [Finding("lag", "warning", "late"), Finding("jitter", "note", "a bit")]
    warned = diagnosis_figures(replace(diagnosis, findings=tuple(said)))[-1]
    assert "1 warning about the data (lag): see Data and choices" in warned.remark
    assert warned.verdict == "open"
    calm = diagnosis_figures(replace(diagnosis, findings=()))[-1]
    assert "0 warnings about the data: taken as recorded" in calm.remark


def test_every_run_is_listed_with_its_use_and_what_is_there_alone(diagnosis: Diagnosis) -> None:
    (named, *_) = diagnosis.effects
    of_one = replace(named, effect=replace(named.effect, runs=("b",)))
    processing = {**diagnosis.processing, "runs": ["a", "b"]}
    found = replace(diagnosis, effects=(of_one,), processing=processing, held_out_run="c")
    (runs,) = (
        block
        for block in diagnosis_sections(found)[-1].blocks
        if isinstance(block, Table) and block.title == "Runs"
    )
    assert runs.rows == (
        ("a", "training", "–"),
        ("b", "training", "viscous friction on elbow"),
        ("c", "held-out", "–"),
    )
    parts = {**diagnosis.processing, "runs": ["a", "b/1"]}
    (runs,) = (
        block
        for block in diagnosis_sections(replace(found, processing=parts))[-1].blocks
        if isinstance(block, Table) and block.title == "Runs"
    )
    assert [row[2] for row in runs.rows] == ["–", "viscous friction on elbow", "–"]
    single = replace(found, processing={**processing, "runs": ["a"]})
    blocks = diagnosis_sections(single)[-1].blocks
    assert not any(isinstance(each, Table) and each.title == "Runs" for each in blocks)


def test_a_held_out_error_that_did_not_fall_is_told_first(diagnosis: Diagnosis) -> None:
    after = replace(diagnosis.after, mean_relative=diagnosis.before.mean_relative)
    bad = replace(diagnosis, after=after)
    first = diagnosis_figures(bad)[0]
    assert first.value == "the held-out error did not fall"
    page, fine = (page_of([Source("d", "d.h5", each)], silent) for each in (bad, diagnosis))
    (answer,) = page.answers
    assert (answer.kind, answer.text) == ("bad", first.remark)
    assert "20.00% before, 20.00% after" in answer.text
    text = render(page)
    assert text.index("20.00% before, 20.00% after") < text.index('<dl class="figures">')
    assert fine.answers[0].kind == "answer"
    assert "did not fall" not in render(fine)


def test_nothing_found(diagnosis: Diagnosis) -> None:
    unnamed = replace(diagnosis, effects=())
    nothing = replace(unnamed, excess_residuals=())
    for each, begins in (
        (unnamed, "No effect of the catalogue explains"),
        (nothing, "Nothing is missing"),
    ):
        (answer,) = page_of([Source("d", "d.h5", each)], silent).answers
        assert answer.text.startswith(begins)
    assert "diagnosis-evidence" not in {each.anchor for each in diagnosis_sections(nothing)}


def test_names_are_escaped_and_sections_without_samples_left_out(plain: Diagnosis) -> None:
    odd = replace(plain, held_out_run="<b>run</b>")
    sections = {each.anchor: each for each in diagnosis_sections(odd)}
    assert not {"diagnosis-time", "diagnosis-evidence"} & set(sections)
    assert "<b>" not in render(Page("old", "", diagnosis_figures(odd), tuple(sections.values())))


def test_joints_that_never_move_are_told_not_drawn(sections: dict[str, Section]) -> None:
    section = sections["diagnosis-errors"]
    assert [chart.title for chart in charts_of(section)] == ["RMS error of the torque, all samples"]
    assert any("No joint moves" in block for block in section.blocks if isinstance(block, str))


@pytest.mark.parametrize(
    ("symbol", "words"),
    [
        ("q[elbow]", "angle of elbow"),
        ("history of load[a b]", "history of rigid-body torque of a b"),
        ("history of q[elbow]", "history of angle of elbow"),
        ("own history of q", "history of own angle"),
        ("own load", "own rigid-body torque"),
        ("time", "time"),
    ],
)
def test_quantities_in_words(symbol: str, words: str) -> None:
    covariate = Covariate.of_code(symbol)
    assert covariate_in_words(covariate) == words
    assert approximation_in_words(Approximation((covariate,))) == f"a function of {symbol}"


def test_a_law_that_jumps_is_drawn_as_a_step_and_a_line_is_not() -> None:
    x = np.linspace(-1.0, 1.0, 400)
    step = Cloud("speed [rad/s]", "N·m", x, np.sign(x), np.sign(x))
    line = replace(step, law=x, partial=x)
    assert np.isnan(law_line(step)[1]).sum() == 1
    assert not np.isnan(law_line(line)[1]).any()
    far = np.abs(x) > 0.4  # no samples about zero
    gap = replace(line, x=x[far], law=x[far], partial=x[far])
    assert not np.isnan(law_line(gap)[1]).any()


def test_bodies_that_changed_stand_with_figures_before_and_after(diagnosis: Diagnosis) -> None:
    robot = build_robot(parse_spec(diagnosis.config).robot, Path(diagnosis.config_folder))
    given = standard_parameters(robot)
    (same,) = body_parts(robot, given)
    assert same == "Bodies: masses and centres of mass are those of the URDF."
    phi = given.copy()
    phi[10:14] *= 1.5  # heavier, with the same centre
    phi[21] += 0.05 * phi[20]  # 50 mm along x
    (table,) = body_parts(robot, phi)
    assert isinstance(table, Table)
    assert "(2 of 5)" in table.title
    heavier, moved = (dict(zip(table.columns, row, strict=True)) for row in table.rows)
    assert float(heavier["mass, model [kg]"]) == pytest.approx(
        1.5 * float(heavier["mass, URDF [kg]"]), rel=1e-3
    )
    assert heavier["centre, model [mm]"] == heavier["centre x, y, z, URDF [mm]"]
    before, after = (moved[name] for name in ("centre x, y, z, URDF [mm]", "centre, model [mm]"))
    assert int(after.split(",")[0]) - int(before.split(",")[0]) == 50
    found = section_of(replace(diagnosis, phi=phi), "found", robot)
    assert table in found.blocks


def test_the_command_line_that_made_it_is_on_the_page(diagnosis: Diagnosis) -> None:
    line = "excite diagnose arm.yaml log.csv --apply better.yaml"
    made = replace(diagnosis, processing={**diagnosis.processing, "command": line})
    lead = section_of(made, "data").lead
    assert f"by `{line}`" in lead
    assert "To go on" not in lead  # that was given
    assert "`excite diagnose … --apply NEW.yaml`" in section_of(diagnosis, "data").lead


def test_the_band_says_which_noise_it_is(diagnosis: Diagnosis) -> None:
    assert "above those of the motion" in section_of(diagnosis, "time").lead
    repeated = replace(diagnosis, noise_floor=dict.fromkeys(diagnosis.joint_names, 0.1))
    assert "what changes between repetitions of a motion" in section_of(repeated, "time").lead
    assert REPEATABILITY in section_of(repeated, "errors").blocks
