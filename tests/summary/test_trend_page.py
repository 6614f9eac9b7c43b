"""The page of the days of a robot: friction of every joint over them."""

import numpy as np

from excite_cli.report.page import render
from excite_cli.report.plot import Plot
from excite_cli.scoring.changes import Known, Snapshot, changes_of
from excite_cli.shown.answer import Charts
from excite_cli.summary.changes import trend_page

_MONTH = 30 * 86_400.0


def _months(count: int, dated: bool = True) -> list[Snapshot]:
    """Viscous friction of eight joints, of which the third's doubles in the fifth month."""
    return [
        Snapshot(
            f"month_{m + 1}",
            {
                "m1": Known(3.0, 0.01, "kg"),
                **{
                    f"viscous friction[joint_{j}]": Known(
                        (2.0 if j == 3 and m >= 4 else 1.0) + 0.001 * j, 0.01, "N·m·s/rad",
                        f"joint_{j}", False, "viscous friction", True,
                    )
                    for j in range(1, 9)
                },
                "spring.stiffness[joint_2]": Known(
                    5.0, 0.1, "N·m/rad", "joint_2", True, "spring: stiffness"
                ),
            },
            m * _MONTH if dated else None,
        )
        for m in range(count)
    ]  # fmt: skip


def _plots(months: list[Snapshot]) -> list[tuple[str, Plot]]:
    page = trend_page(changes_of(months), "months")
    blocks = [(section.anchor, block) for section in page.sections for block in section.blocks]
    return [
        (anchor, plot)
        for anchor, block in blocks
        if isinstance(block, Charts)
        for plot in block.charts
        if isinstance(plot, Plot)
    ]


def test_every_joint_is_drawn_over_the_days_with_its_whiskers_friction_first() -> None:
    (first, friction), (second, spring) = _plots(_months(8))
    assert (first, second) == ("friction", "others")
    assert spring.title == "spring: stiffness"
    assert np.allclose(friction.x, 30.0 * np.arange(8))
    series = [each for panel in friction.panels for each in panel.series]
    assert [each.label for each in series] == [f"joint_{j}" for j in range(1, 9)]
    assert np.allclose(series[2].y, [1.003] * 4 + [2.003] * 4)
    assert series[2].low is not None
    assert np.allclose(series[2].y - series[2].low, 0.02)
    assert "joint_3 since month_5" in friction.alternative
    for panel in friction.panels:
        assert panel.span is not None
        assert panel.span[0] < 0.98 < 2.02 < panel.span[1], "whiskers of all joints, one scale"
    assert max(len(panel.series) for panel in friction.panels) <= 6, "no colour twice in a panel"


def test_days_without_stamps_are_counted() -> None:
    _, (_, spring) = _plots(_months(8, dated=False))
    assert spring.counted
    assert np.array_equal(spring.x, np.arange(1.0, 9.0))


def test_the_page_is_whole() -> None:
    text = render(trend_page(changes_of(_months(8)), "months <of> a robot"))
    assert "joint_3" in text
    assert "<of>" not in text
