"""The robot where it is nearest to something: capsules to scale, the nearest two in vermilion."""

import re

import numpy as np
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.excitation.nearest import closest_time
from excite_cli.geometry.mesh_distances import CoalDistances
from excite_cli.report.chart import in_figures
from excite_cli.report.posture_chart import posture_chart, robot_chart
from excite_cli.robot.tree import Skeleton
from excite_cli.trajectory.fade import Segment
from tests.cli.program import SMOKE
from tests.report.case import Case

PATH = re.compile(
    r'd="M([\d.-]+) ([\d.-]+)L([\d.-]+) ([\d.-]+)" style="stroke: ([^;]*); stroke-width: ([\d.]+)'
)


@pytest.fixture(scope="module")
def svg(case: Case) -> str:
    problem, result = case
    return posture_chart(problem, result.motions[0]).svg


def test_the_nearest_two_are_those_of_coal(case: Case, svg: str) -> None:
    problem, result = case
    kept = next(each for each in problem.constraints if isinstance(each, SelfCollision))
    motion = result.motions[0]
    at = closest_time(problem, Segment("", problem.trajectory, motion.coefficients))
    q = problem.trajectory.states(np.array([at]), motion.coefficients)[0]
    distances = CoalDistances(problem.robot, kept.capsules, kept.pairs.checked).distances(q)[0]
    first, second = kept.pairs.checked[int(np.argmin(distances))]
    warm = [each for each in PATH.findall(svg) if "vermilion" in each[4]]
    assert len(warm) == 3  # two capsules, and the line between them
    line = warm[-1]
    scale = _scale(svg, kept)
    radii = sorted(kept.capsules[k].radius for k in (first, second))
    widths = sorted(float(each[5]) + 1.4 for each in warm[:2])  # the rim
    assert widths == pytest.approx([2 * r * scale for r in radii], abs=0.11)
    length = np.hypot(float(line[2]) - float(line[0]), float(line[3]) - float(line[1]))
    assert length <= distances.min() * scale + 0.2
    chart = posture_chart(problem, result.motions[0])
    assert f"distance {in_figures(1e3 * distances.min())} mm" in chart.caption
    assert kept.capsules[first].name in chart.alternative


def _scale(svg: str, kept: SelfCollision) -> float:
    """Points of the drawing per metre, by the thickest capsule."""
    widest = max(float(each[5]) for each in PATH.findall(svg))
    return widest / (2 * max(c.radius for c in kept.capsules))


def test_all_of_it_is_within_the_drawing(svg: str) -> None:
    width, height = map(float, re.search(r'viewBox="0 0 (\S+) (\S+)"', svg).groups())  # type: ignore[union-attr]
    for *ends, _, stroke in PATH.findall(svg):
        for x, y in (ends[:2], ends[2:]):
            assert float(stroke) / 2 <= float(x) <= width - float(stroke) / 2
            assert float(stroke) / 2 <= float(y) <= height - float(stroke) / 2


def test_a_floor_is_drawn_where_it_is(case: Case, svg: str) -> None:
    """Four thin lines; the lower the floor, the lower they are drawn."""
    problem, result = case
    assert "No floor is modelled." in posture_chart(problem, result.motions[0]).caption
    found = []
    for height in (-0.3, -0.6):
        low = load_problem(SMOKE, [f"constraints.surroundings={{floor: {height}}}"])
        chart = posture_chart(low, result.motions[0])
        assert "The frame is the floor." in chart.caption
        lines = [each for each in PATH.findall(chart.svg) if each[5] == "0.8"]
        assert len(lines) == 4
        assert not [each for each in PATH.findall(svg) if each[5] == "0.8"]
        kept = next(each for each in low.constraints if isinstance(each, SelfCollision))
        middle = np.mean([(float(each[1]) + float(each[3])) / 2 for each in lines])
        robot = [float(each[1]) for each in PATH.findall(chart.svg) if each[5] != "0.8"]
        found.append((middle - max(robot)) / _scale(chart.svg, kept))
    assert found[1] - found[0] == pytest.approx(0.3 * np.cos(np.deg2rad(18)), rel=0.1)


ARM = Skeleton(
    base=(0.0, 0.0, 0.0),
    joints=((0.0, 0.0, 0.3), (0.2, 0.0, 0.6), (0.5, 0.1, 0.6)),
    parents=(-1, 0, 1),
    tips=((0.0, 0.0, 0.3), (0.2, 0.0, 0.6), (0.7, 0.1, 0.5)),
)


def test_joints_have_names_shares_and_colours() -> None:
    shares = {"a<b>": 0.02, "b": 0.08, "c": float("nan")}
    chart = robot_chart("Robot", ARM, tuple(shares), shares, "Error of the torque")
    assert "a&lt;b&gt; 2.0%" in chart.svg
    assert "c –" in chart.svg
    colours = re.findall(r"<circle[^>]*fill: ([^;]*);", chart.svg)
    assert colours == [
        "color-mix(in oklab, var(--vermilion) 25%, var(--green))",
        "color-mix(in oklab, var(--vermilion) 100%, var(--green))",
        "var(--muted)",
    ]
    assert chart.alternative.index("b 8.0%") < chart.alternative.index("a<b> 2.0%")


def test_it_stays_within_its_drawing_with_many_joints() -> None:
    n = 40
    chain = Skeleton(
        (0.0, 0.0, 0.0),
        tuple((0.1 * k, 0.0, 0.2 * k) for k in range(n)),
        tuple(range(-1, n - 1)),
        tuple((0.1 * k, 0.0, 0.2 * k) for k in range(n)),
    )
    names = [f"joint_{k}" for k in range(n)]
    chart = robot_chart("Robot", chain, names, dict.fromkeys(names, 0.1), "Error")
    width, height = map(float, re.search(r'viewBox="0 0 (\S+) (\S+)"', chart.svg).groups())  # type: ignore[union-attr]
    for x, y in re.findall(r'cx="([\d.-]+)" cy="([\d.-]+)"', chart.svg):
        assert 0 < float(x) < width
        assert 0 < float(y) < height
