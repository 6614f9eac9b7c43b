"""A grid of shares: a cell for each that is told, darker for more, within the drawing."""

import re

import numpy as np

from excite_cli.report.dependence_chart import share_map

CELL = re.compile(
    r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="[\d.]+" '
    r'style="fill: var\(--blue\); opacity: ([\d.]+)"'
)


def test_cells_stand_for_shares() -> None:
    shares = np.array([[0.5, 0.001], [0.02, 0.9]])
    chart = share_map("t", "w", ["time", "speed of <b>"], ["j1", "j2"], shares, 0.01)
    cells = [tuple(map(float, cell)) for cell in CELL.findall(chart.svg)]
    assert len(cells) == 3
    half, small, most = cells
    assert small[3] < half[3] < most[3]
    assert half[0] == small[0] < most[0]  # columns
    assert half[1] < small[1] == most[1]  # rows
    for figure in ("50", "2", "90"):
        assert f">{figure}</text>" in chart.svg
    assert "&lt;b&gt;" in chart.svg
    assert not chart.wide


def test_many_columns_are_wide_and_stay_within() -> None:
    names = [f"some_long_joint_name_{k}" for k in range(12)]
    chart = share_map("t", "w", ["time"], names, np.full((1, 12), 0.3), 0.01)
    assert chart.wide
    width = float(re.search(r'viewBox="0 0 (\S+) ', chart.svg)[1])  # type: ignore[index]
    assert all(
        0 < float(x) < float(x) + float(w) <= width for x, _, w, _ in CELL.findall(chart.svg)
    )
