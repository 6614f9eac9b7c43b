"""What the page says about motions is what the result holds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.config.load_spec import parse_spec, spec_as_yaml
from excite_cli.criteria.base import singular_values
from excite_cli.excitation.objective import Stack
from excite_cli.report.chart import in_figures
from excite_cli.report.condition_chart import condition_chart, random_stack
from excite_cli.report.page import render
from excite_cli.report.plot import Plot
from excite_cli.shown.answer import Block, Charts, Choice, Page, Section, Table, Text
from excite_cli.summary.assembly import Source, page_of
from excite_cli.summary.result_page import (
    condition_section,
    drawn_motions,
    margin_section,
    motion_section,
    result_figures,
)
from excite_cli.summary.side_by_side import comparable, compare_results, differences
from excite_cli.summary.weakest import weakest_section
from tests.report.case import Case
from tests.report.structure import Structure

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _of(kind: type, blocks: tuple[Block, ...]) -> list[Block]:
    return [block for block in blocks if isinstance(block, kind)]


def _table(section: Section, title: str) -> Table:
    (found,) = (b for b in section.blocks if isinstance(b, Table) and title in b.title)
    return found


def _said(section: Section) -> str:
    return Structure(render(Page("t", "s", (), (section,)))).text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (5.1862, "5.19"),
        (143.4, "143"),
        (11332.3, "11332"),
        (2.5e7, "2.50e+07"),
        (0.00123, "0.00123"),
        (1e-9, "1.00e-09"),
        (0.0, "0"),
        (10.0, "10.0"),
        (float("inf"), "∞"),
        (float("nan"), "–"),
    ],
)
def test_numbers_as_people_write_them(value: float, text: str) -> None:
    assert in_figures(value) == text


def test_condition_numbers_beside_random_ones(case: Case) -> None:
    problem, result = case
    section = condition_section(result, problem)
    reached, random = (
        found[-1].stacked_condition_number for found in (result.motions, result.random)
    )
    assert f"{in_figures(random / reached)} times worse" in section.lead
    assert "20 admissible random motions (30 drawn)" in section.lead
    beside = _table(section, "optimised and random").rows[0]
    assert beside[1:] == (
        f"{result.motions[0].condition_number:.1f}",
        f"{reached:.1f}",
        f"{result.random[0].condition_number:.1f}",
        f"{result.random[0].stacked_condition_number:.1f}",
        f"{result.random[0].stacked_condition_number / reached:.2f}",
    )
    assert [figure.value for figure in result_figures(result, problem)][:2] == [
        in_figures(reached),
        in_figures(random),
    ]
    assert _of(str, section.blocks) == []


def test_without_random_motions_it_says_how_to_get_them(case: Case) -> None:
    problem, result = case
    section = condition_section(replace(result, random=()), problem)
    assert "excite compare-random" in _said(section)
    assert "random" not in section.lead
    assert len([block for block in section.blocks if isinstance(block, Table)]) == 1


def test_indices_with_gaps_have_their_own_places(case: Case) -> None:
    _, result = case
    (one, two) = result.random
    gaps = replace(result, random=(replace(one, index=1), replace(two, index=7)))
    plot = condition_chart(gaps)
    assert plot.x.tolist() == [1.0, 7.0]
    stacked = next(s for s in plot.panels[0].series if s.label == "random, stacked")
    assert np.isfinite(stacked.y).all()


def test_a_condition_number_that_is_not_finite(case: Case) -> None:
    problem, result = case
    motion = replace(result.motions[0], condition_number=float("inf"))
    section = condition_section(replace(result, motions=(motion,), random=()), problem)
    assert _table(section, "Condition numbers").rows[0][1] == "inf"


def test_a_card_for_every_joint_and_a_choice_of_motions(case: Case) -> None:
    problem, result = case
    motion = result.motions[0]
    two = replace(result, motions=(motion, replace(motion, index=2)))
    section = motion_section(two, problem)
    (choice,) = _of(Choice, section.blocks)
    assert isinstance(choice, Choice)
    assert [text for text, _ in choice.options] == ["motion 1", "motion 2"]
    cards = choice.options[0][1][0]
    assert isinstance(cards, Charts)
    assert [chart.title for chart in cards.charts] == list(problem.robot.joint_names)
    peaks = choice.options[0][1][1]
    assert isinstance(peaks, Table)
    q, v, _ = problem.trajectory.basis(np.linspace(0, 6, 400)).states(motion.coefficients)
    limits = problem.robot.limits.velocity
    for joint, row in enumerate(peaks.rows):
        assert row[1].startswith(f"{in_figures(float(q[:, joint].min()))} … ")
        share = np.abs(v[:, joint]).max() / limits[joint]
        assert row[3].endswith(f"({100 * share:.0f} %)")
    assert peaks.rows[4][1].endswith(" m")


def test_many_motions_are_not_all_drawn(case: Case) -> None:
    _, result = case
    motions = tuple(replace(result.motions[0], index=k) for k in range(1, 51))
    assert len(drawn_motions(motions, 30)) == 4
    assert len(drawn_motions(motions, 400)) == 1
    assert drawn_motions(motions[:3], 30) == motions[:3]


def test_margins_name_the_worst_and_the_verdict(case: Case) -> None:
    problem, result = case
    motion = result.motions[0]
    assert all(motion.certified.values())
    section = margin_section(result, problem)
    assert "proved to hold at every instant" in _said(section)
    rows = {row[0]: row for row in _table(section, "Worst margins").rows}
    worst = motion.margins["self_collision"]
    assert rows["self_collision"][1:] == (
        f"{worst.margin:.4f}",
        "m",
        worst.label,
        "1",
        f"{worst.time:.3f}",
        f"{100 * worst.share:.2g} %",
        "proved",
    )
    (choice,) = _of(Choice, section.blocks)
    assert isinstance(choice, Choice)
    charts = choice.options[0][1][0]
    assert isinstance(charts, Charts)
    assert len(charts.charts) == len(problem.constraints)
    said = charts.charts[-1].alternative
    assert worst.label in said
    assert f"{worst.time:.3f} s" in said
    figure = result_figures(result, problem)[-1]
    assert figure.value == "all proved"


@pytest.mark.parametrize(
    ("certified", "violations", "words", "kind", "value"),
    [
        ({}, 0, "nothing was proved", "plain", "kept at 1 kHz"),
        (
            {"joint_torque": False, "self_collision": True},
            0,
            "not proved between: joint_torque (motion 1)",
            "bad",
            "1 of 2 proved",
        ),
        (
            {"self_collision": True},
            3,
            "Broken at controller rate: self_collision",
            "bad",
            "BROKEN",
        ),
    ],
)
def test_what_is_not_proved_is_not_said_to_be(
    case: Case,
    certified: dict[str, bool],
    violations: int,
    words: str,
    kind: str,
    value: str,
) -> None:
    problem, result = case
    motion = result.motions[0]
    worst = replace(motion.margins["self_collision"], violations=violations)
    margins = {**motion.margins, "self_collision": worst}
    changed = replace(motion, certified=certified, margins=margins)
    other = replace(result, motions=(changed,))
    verdict, *_ = _of(Text, margin_section(other, problem).blocks)
    assert isinstance(verdict, Text)
    assert words in verdict.text
    assert verdict.kind == kind
    figure = result_figures(other, problem)[-1]
    assert value in figure.value


def test_the_weakest_direction_is_that_of_the_stack(case: Case) -> None:
    problem, result = case
    rank = problem.base.rank
    sizes = np.full(rank, 10.0)
    sizes[3] = 0.5
    stack = Stack(np.diag(sizes), 300)
    section = weakest_section(replace(result, stack=stack), problem)
    name = problem.base.names[result.base_selection[3]]
    assert f"mostly {name}, which makes up 100 % of it" in section.lead
    assert "0.500, 20.0 times less" in section.lead
    assert _table(section, "weakest direction").rows[0][:3] == (name, "+1.00", "100 %")
    rows = {row[0]: row for row in _table(section, "would be known").rows}
    assert rows[name][3] == "2.00"
    assert all(row[3] == "0.100" for key, row in rows.items() if key != name)


def test_a_singular_stack_is_told(case: Case) -> None:
    problem, result = case
    stack = Stack(np.diag([1.0, *np.zeros(problem.base.rank - 1)]), 1)
    section = weakest_section(replace(result, stack=stack), problem)
    assert "does not show at all" in section.lead


def test_configs_that_differ_are_told_key_by_key(case: Case) -> None:
    _, result = case
    config = result.config
    spec = parse_spec(config)
    torque = {"constraints.torque.scale": 0.5, "seed": 7}
    changed = parse_spec(config, overrides=[f"{key}={value}" for key, value in torque.items()])
    table = differences({"a": spec_as_yaml(spec), "b": spec_as_yaml(changed)})
    assert isinstance(table, Table)
    assert set(table.rows) == {("constraints.torque.scale", "0.9", "0.5"), ("seed", "1", "7")}
    assert isinstance(differences({"a": config, "b": config}), str)


def test_results_side_by_side(case: Case) -> None:
    _, result = case
    slow = replace(result.motions[0], stacked_condition_number=99.0)
    other = replace(result, motions=(slow,), random=())
    section = compare_results({"smoke": result, "other": other})
    assert section.lead.endswith("Lowest: smoke.")
    assert [row[0] for row in _table(section, "Condition numbers").rows] == ["smoke", "other"]
    assert len(_of(Charts, section.blocks)) == 1


def test_other_weights_are_not_compared(case: Case) -> None:
    _, result = case
    other = replace(result, row_weights=2 * result.row_weights)
    assert comparable([result, result])
    assert not comparable([result, other])
    section = compare_results({"one": result, "other": other})
    assert "do not compare" in _said(section)
    assert "Lowest" not in section.lead
    assert _of(Charts, section.blocks) == []


def test_several_files_have_sections_of_their_own(case: Case) -> None:
    problem, result = case
    sources = [Source(name, f"{name}.h5", result, problem) for name in ("first", "second")]
    page = page_of(sources, lambda name, done: None)
    anchors = [section.anchor for section in page.sections]
    assert len(anchors) == len(set(anchors))
    assert anchors[0] == "compare"
    titles = [section.title for section in page.sections[1:]]
    assert "Motions: first" in titles
    assert "Motions: second" in titles
    assert "same, key by key" in _said(page.sections[0])


def test_the_spectrum_of_random_motions_stands_on_the_prior(case: Case) -> None:
    problem, result = case
    prior = Stack(1e3 * np.eye(problem.columns), 10)
    sigma = singular_values(random_stack(replace(result, prior_stack=prior), problem))
    assert sigma[-1] >= 1e3


def test_weights_and_scales_are_said(case: Case) -> None:
    problem, result = case
    assert "Of the regressor" not in condition_section(result, problem).lead
    weighting = replace(problem.weighting, row_name="effort", column_name="unit_norm")
    section = condition_section(result, replace(problem, weighting=weighting))
    words = "Of the regressor with rows weighted (effort), columns scaled (unit norm)."
    assert section.lead.endswith(words)


def test_without_limits_cards_speak_of_peaks(case: Case) -> None:
    problem, result = case
    free = replace(problem, constraints=())
    (choice,) = _of(Choice, motion_section(result, free).blocks)
    assert isinstance(choice, Choice)
    cards = choice.options[0][1][0]
    assert isinstance(cards, Charts)
    assert isinstance(cards.charts[0], Plot)
    assert cards.charts[0].panels[1].axis == "share of peak [–]"
    assert "limits none to none" in cards.charts[0].alternative
    assert "nothing to keep away from" in _said(margin_section(result, free))
    assert [figure.name for figure in result_figures(result, free)][-1] == "motions"


def test_the_margins_say_of_which_pairs_they_speak(case: Case) -> None:
    problem, result = case
    said = _said(margin_section(result, problem))
    assert "all 7 relevant" in said
    assert "Not modelled: the floor and all else around the robot" in said
    config = "constraints.self_collision.ignore=[[base, wrist]]"
    problem = load_problem(SMOKE, [config])
    section = margin_section(result, problem)
    said = _said(section)
    assert "link pairs checked." in said
    assert "NOT GUARDED" not in said
    table = _table(section, "not checked")
    assert table.rows == (("base – wrist", "ignored in the config"),)
