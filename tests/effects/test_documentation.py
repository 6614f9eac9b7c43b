"""The page on effects says what the catalogue has, and its example works as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EFFECTS, catalogue, declared_effects
from excite_cli.effects.sign import sign_of_width
from excite_cli.excitation.gradient_check import central_differences, relative_error
from excite_cli.robot.model import Array
from tests.effects import own_package
from tests.effects.motions import signals_at, signals_of, states
from tests.registries import read_anew
from tests.robot.random_robots import random_robot

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "effects.md").read_text(encoding="utf-8")


_read_anew = read_anew(EFFECTS)


@pytest.mark.parametrize("name", list(catalogue()))
def test_page_names_every_parameter_with_its_unit(name: str) -> None:
    section = re.search(rf"### {name}\n(.*?)(?=\n##|\Z)", PAGE, re.DOTALL)
    assert section is not None, f"docs/effects.md has no section on {name}"
    text = section.group(1)
    kind = catalogue()[name]
    for parameter in (*kind.parameters, *kind.shapes):
        assert f"`{parameter.name}`" in text
        assert f"[{parameter.unit}]" in text
    assert f"scope {kind.scope}" in text
    ones = np.ones(len(kind.parameters))
    assert ("URDF `" in text) == bool(kind((0,)).urdf(ones))
    assert ("MJCF `" in text) == bool(kind((0,)).mjcf(ones))
    assert ("No motion is planned" in text) != kind.excitable


def test_page_says_how_every_kind_is_judged() -> None:
    """Row by row: prior_cost, when it is asked for, after what, never beside what."""
    table = PAGE.split("## How a diagnosis judges them")[1].split("\n## ")[0]
    row = r"^\| `(\w+)` \| (\d+) \| (\w+) \| (.*?) ?\| (.*?) ?\|$"
    rows = re.findall(row, table, re.MULTILINE)
    assert [name for name, *_ in rows] == list(catalogue())
    for name, prior_cost, when, *others in rows:
        kind = catalogue()[name]
        assert float(prior_cost) == kind.prior_cost
        assert when == ("first", "then", "last")[kind.tier - 1]
        assert [tuple(re.findall(r"\w+", each)) for each in others] == [kind.refines, kind.excludes]
    # Page has no section on what there is not.
    assert re.findall(r"^### (\w+)$", PAGE, re.MULTILINE) != []
    assert set(re.findall(r"^### (\w+)$", PAGE, re.MULTILINE)) == set(catalogue())


def test_how_to_names_every_trait_with_its_default() -> None:
    page = own_package.PAGE.read_text(encoding="utf-8")
    follows = {"joints", "runs", "kind", "active", "exclusive_with", "torque"}
    follows |= {"is_change", "is_friction", "is_searched", "asked_for", "builds_on"}
    follows |= {"signal_to_error", "why_impossible", "report_on"}
    stated = {name for name in vars(Effect) if not name.startswith("_")} - follows
    assert sorted(name for name in stated if name not in page) == []
    assert f"| {Effect.prior_cost:g} |" in page
    assert f"`{Effect.tier.name}` |" in page


def test_example_is_a_kind_of_the_catalogue_once_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = own_package.blocks("python")[0]
    assert len([line for line in columns.splitlines() if line.strip()]) <= 30
    own_package.install(tmp_path, columns, own_package.points(), monkeypatch)
    robot = random_robot(4, joints=3, branches=False, prismatic=False)
    spec = EffectSpec(kind="roller_friction", joints=("joint_2",))
    (effect,) = declared_effects((spec,), robot)
    assert isinstance(effect, Effect)
    signals = signals_of(robot, 300)
    noise = 0.01 * np.random.default_rng(0).normal(size=300)
    planted = effect.torque(signals, np.array([1.2, -0.5]))[:, 1] + noise
    found = np.linalg.lstsq(effect.columns(signals)[:, 0], planted, rcond=None)[0]
    assert found == pytest.approx([1.2, -0.5], abs=0.01)
    assert effect.report(found, np.eye(2))["cos"].unit == "N·m·s/rad"
    _, *state = states(robot, 4, 0.1)
    weights = np.random.default_rng(1).normal(size=(4, 1, 2))

    def value(x: Array) -> float:
        at = signals_at(robot, np.arange(4.0), *x)
        return float((weights * effect.columns(at)).sum())

    with sign_of_width(0.5):
        back = effect.pull_back(signals_at(robot, np.arange(4.0), *state), weights)
        reference = central_differences(value, np.array(state))
    assert back.a is None
    assert relative_error(np.stack([back.q, back.v, 0 * back.q]), reference) < 1e-7
