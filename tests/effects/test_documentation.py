"""The page on effects says what the catalogue has, and its example works as it stands."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import GROUP, catalogue, declared_effects
from excite_cli.effects.sign import sign_of_width
from excite_cli.excitation.differences import central_differences, relative_error
from excite_cli.robot.model import Array
from tests.effects.motions import signals_at, signals_of, states
from tests.robot.random_robots import random_robot

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "effects.md").read_text(encoding="utf-8")
OWN_EFFECT = (DOCS / "how-to" / "effect.md").read_text(encoding="utf-8")


def _block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", OWN_EFFECT, re.DOTALL)
    assert found is not None
    return found.group(1)


@pytest.fixture(autouse=True)
def _catalogue_read_anew() -> Iterator[None]:
    catalogue.cache_clear()
    yield
    catalogue.cache_clear()


def _install(folder: Path, code: str, points: dict[str, str], module: str) -> None:
    """What an installer leaves of a package with one module."""
    (folder / f"{module}.py").write_text(code, encoding="utf-8")
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    lines = [f"[{GROUP}]", *(f"{name} = {value}" for name, value in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


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


def test_page_has_no_section_on_what_there_is_not() -> None:
    assert re.findall(r"^### (\w+)$", PAGE, re.MULTILINE) != []
    assert set(re.findall(r"^### (\w+)$", PAGE, re.MULTILINE)) == set(catalogue())


def test_example_is_a_kind_of_the_catalogue_once_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = _block("python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 30
    points = tomllib.loads(_block("toml"))["project"]["entry-points"][GROUP]
    _install(tmp_path, code, points, "my_effects")
    monkeypatch.syspath_prepend(tmp_path)
    robot = random_robot(4, joints=3, branches=False, prismatic=False)
    spec = EffectSpec(kind="eccentric_friction", joints=("joint_2",))
    (effect,) = declared_effects((spec,), robot)
    assert isinstance(effect, Effect)
    signals = signals_of(robot, 300)
    noise = 0.01 * np.random.default_rng(0).normal(size=300)
    planted = effect.torque(signals, np.array([1.2, -0.5]))[:, 1] + noise
    found = np.linalg.lstsq(effect.columns(signals)[:, 0], planted, rcond=None)[0]
    assert found == pytest.approx([1.2, -0.5], abs=0.01)
    assert effect.report(found, np.eye(2))["cos"].unit == "N·m"
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
