"""Effects of other packages: what cannot be used is named and set aside, and all else works."""

from pathlib import Path

import pytest

import excite_cli as api
from excite_cli.effects.catalogue import EFFECTS, catalogue, kind_named
from excite_cli.errors import ConfigError, ExciteWarning
from tests.effects import own_package
from tests.registries import read_anew
from tests.trust.conftest import SMOKE
from tests.trust.in_process import excite

OURS = 31
GOOD = """
import numpy as np
from excite_cli.effects.spring import Spring

class Mine(Spring):
    kind = "mine"
    title = "mine"
"""
COLUMNS = """
    def columns(self, signals):
        {}
"""
UNUSABLE = {
    "missing": ("", "Missing", "cannot be loaded"),
    "raises": ("raise RuntimeError('no licence')", "Mine", "RuntimeError: no licence"),
    "exits": ("import sys; sys.exit(3)", "Mine", "SystemExit: 3"),
    "nameless": (GOOD.replace('"mine"', '""'), "Mine", "does not state its kind, title"),
    "of no kind": (
        GOOD + "    refines = ('coulom_friction',)\n",
        "Mine",
        "`refines` names 'coulom_friction', which does not exist. Did you mean 'coulomb_friction'",
    ),
}
FAILING = {
    "raises": "raise ZeroDivisionError('of mine')",
    "exits": "raise SystemExit(4)",
    "of a wrong shape": "return np.zeros((3, 3))",
    "not finite": "return super().columns(signals) * np.nan",
    "words": "return np.full((len(signals.t), 1, 1), 'x')",
}


_read_anew = read_anew(EFFECTS)


@pytest.mark.parametrize("case", UNUSABLE)
def test_an_effect_that_cannot_be_used_is_set_aside(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, name, message = UNUSABLE[case]
    install(tmp_path, code, name, monkeypatch)
    with pytest.warns(ExciteWarning, match=f"'mine'.*set aside.*{message}"):
        kinds = catalogue()
    assert len(kinds) == OURS
    with pytest.raises(ConfigError, match="A package has one, which cannot be used"):
        kind_named("mine")


def test_the_program_works_on_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, "import sys; sys.exit(3)", "Mine", monkeypatch)
    config = tmp_path / "arm.yaml"
    urdf = SMOKE.parent.parent / "data" / "smoke_arm.urdf"
    text = SMOKE.read_text().replace("../data/smoke_arm.urdf", str(urdf))
    config.write_text(f"{text}effects: [{{kind: viscous_friction}}]\n")
    options = ("--set", "optimizer.max_iterations=1", "--motions", "1", "-o", tmp_path / "arm.h5")
    ended = excite("optimize", config, *options)
    assert ended.returncode == 0, ended
    assert "warning: effect 'mine' (foreign_effects:Mine) of a package is set aside" in ended.stderr
    assert (tmp_path / "arm.h5").is_file()


@pytest.mark.parametrize("case", FAILING)
def test_columns_that_fail_are_set_aside_by_the_diagnosis(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from excite_cli.diagnosis.candidates import possible_effects
    from excite_cli.diagnosis.in_runs import SeenRuns
    from excite_cli.effects.base import Signals
    from tests.effects.motions import signals_of
    from tests.robot.random_robots import random_robot

    install(tmp_path, GOOD + COLUMNS.format(FAILING[case]), "Mine", monkeypatch)
    robot = random_robot(9, joints=3, branches=False)
    signals: list[Signals] = [signals_of(robot, 30)]
    seen = SeenRuns(robot, signals, [signals[0].load], ["run"])
    spec = api.load_case(SMOKE).spec.diagnosis.model_copy(update={"kinds": ("mine", "spring")})
    with pytest.warns(ExciteWarning, match="'mine' of a package is set aside"):
        found = possible_effects(spec, (), seen, {})
    assert {effect.kind for effect, _ in found} == {"spring"}


def install(folder: Path, code: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package with one module, that declares the effect `mine`."""
    module = "foreign_effects"
    own_package.install(folder, code, {"mine": f"{module}:{name}"}, monkeypatch, module)
