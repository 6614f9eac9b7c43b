"""Benchmarks of many runs and of orders: the campaigns are what they say, tables tell the truth."""

import numpy as np

from benchmarks.orders import Answer, summary
from benchmarks.problems import CONFIGS
from benchmarks.runs import CAMPAIGNS, Campaign, made, row
from excite_cli.api.loading import load_case


def test_bursts_of_nan_cut_every_run_into_its_parts() -> None:
    robot = load_case(CONFIGS / "ur10.yaml").robot
    data = made(robot, Campaign("two runs", (4.0, 4.0), 3))
    for run in data.runs:
        known = np.isfinite(run.q).all(axis=1)
        assert np.count_nonzero(np.diff(known.astype(int)) == 1) == 2
        assert np.array_equal(known, np.isfinite(run.tau).all(axis=1))
    assert CAMPAIGNS["nan"].parts * len(CAMPAIGNS["nan"].seconds) == 42


def test_ratios_are_per_sample() -> None:
    four = {"seconds": 6.0, "samples": 6000, "megabytes": 300.0, "named": []}
    more = {"seconds": 48.0, "samples": 24000, "megabytes": 450.0, "named": ["payload@all"]}
    cells = row(CAMPAIGNS["16"], more, four).split()
    assert cells[-5:] == ["2.000", "2.00", "450", "1.50", "payload@all"]
    assert "not within" in row(CAMPAIGNS["16"], {"error": "not within 4 GB: killed"}, four)


def test_an_order_is_right_with_payload_and_friction() -> None:
    def of(order: str, *runs: str, friction: bool = True) -> Answer:
        names = ("payload@all", *(["load_dependent_friction@elbow_joint"] if friction else []))
        nan = float("nan")
        words = tuple(order.split())
        payloads = (runs,) if runs else ()
        return Answer(words, words[-1], names, payloads, (2.6, 0.1), 0.1, 0.02, (nan, nan))

    good = of("loaded a b c", "loaded")
    assert good.right
    assert not of("loaded a b c", "loaded", "c").right
    assert not of("loaded a b c", "loaded", friction=False).right
    assert of("a b c loaded").right
    told = summary([good, of("a b c loaded", "c")])
    assert told[0].startswith("1 of 1 orders")
    assert told[1].startswith("0 of 1 with it held-out")
    assert told[2].startswith("2 of 2")
