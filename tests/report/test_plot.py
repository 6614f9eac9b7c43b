"""What the page's script is told of a chart: numbers within their steps, gaps and absent points."""

import base64
import json

import numpy as np
import pytest

from excite_cli.report.plot import Curve, Panel, Plot, encoded, merged
from excite_cli.robot.model import Array


def decoded(told: dict[str, object]) -> Array:
    """As the page's script reads it: NaN breaks a line, infinite is no point."""
    whole = np.frombuffer(base64.b64decode(str(told["d"])), "<i2")
    values = float(str(told["lo"])) + (whole.astype(float) + 32767) * float(str(told["step"]))
    return np.select([whole == -32768, whole == 32767], [np.nan, np.inf], values)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 3e7])
def test_numbers_come_back_within_a_step_of_their_range(scale: float) -> None:
    values = scale * np.random.default_rng(0).normal(size=500)
    values[[3, 4]], values[7] = np.nan, np.inf
    back = decoded(encoded(values))
    known = np.isfinite(values)
    assert np.abs(back[known] - values[known]).max() < np.ptp(values[known]) / 60_000
    assert np.isnan(back[[3, 4]]).all()
    assert np.isinf(back[7])


@pytest.mark.parametrize("values", [[], [2.5], [np.nan], [4.0, 4.0, 4.0]])
def test_few_or_equal_or_no_numbers(values: list[float]) -> None:
    assert decoded(encoded(np.array(values))) == pytest.approx(values, nan_ok=True)


def test_points_over_several_x_keep_their_places() -> None:
    x, (one, two) = merged(
        (np.array([2.0, 0.0]), np.array([20.0, 0.0])), (np.array([1.0]), np.array([np.nan]))
    )
    assert x.tolist() == [0.0, 1.0, 2.0]
    assert one.tolist() == [0.0, np.inf, 20.0]
    assert np.isnan(two[1])
    assert np.isinf(two[[0, 2]]).all()


def test_no_limit_is_told_as_none() -> None:
    series = Curve("a", np.array([1.0, 2.0]), "blue")
    plot = Plot("t", "w", "time [s]", np.array([0.0, 1.0]), (Panel("y", (series,)),))
    (panel,) = json.loads(plot.data)["panels"]
    assert panel["limits"] == [None, None]
    assert panel["span"] is None
