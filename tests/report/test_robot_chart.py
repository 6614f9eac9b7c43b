"""The robot as lines: every joint with its name and share, the worst in the warmest colour."""

import re

from excite_cli.report.robot_chart import robot_chart
from excite_cli.robot.tree import Skeleton

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
