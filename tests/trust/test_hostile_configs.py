"""Configs made to run code, to fill memory or to take for ever."""

from pathlib import Path

import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.config.plain_yaml import LONGEST_NUMBER, MAX_VALUES
from excite_cli.excitation.problem import with_sampling
from excite_cli.trajectory.catalogue import build_trajectory
from tests.trust.refusals import refused

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"

ROBOT = "robot: {urdf: arm.urdf}\n"
BOMB = "a0: &a0 [x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 10)
)


HOSTILE = {
    "bomb": (BOMB, "aliases"),
    "recursion": ("robot: &a {urdf: *a}", "aliases"),
    "brackets": ("[" * 100_000, "nested deeper"),
    "braces": ("{a: " * 100_000, "nested deeper"),
    "dashes": ("- " * 100_000, "nested deeper"),
    "many keys": ("".join(f"k{k}: 1\n" for k in range(80_000)), f"more than {MAX_VALUES:,}"),
    "digits": (f"{ROBOT}seed: " + "9" * 300_000, "a number of 300000 characters"),
    # To the base of 60, as YAML 1.1 has it: quadratic in time.
    "sixty": (f"{ROBOT}seed: 1" + ":59" * 200_000, "a number of 600001 characters"),
    # More digits than Python prints.
    "hexadecimal": (f"{ROBOT}seed: 0x" + "f" * (LONGEST_NUMBER - 2), "allowed"),
    "merge": ("robot: {<<: {urdf: a, mass: 1}, urdf: b}", "merge keys (<<)"),
    "code": ("robot: !!python/object/apply:os.system [id]", "not valid YAML"),
    "long value": (ROBOT + "x: " + "y" * 900_000, "unknown key"),
    "long key": (ROBOT + "x" * 900_000 + ": 1", "not valid YAML"),
    "doubled joints": ("robot: {urdf: a, joints: [" + "x, " * 40_000 + "]}", "named twice: x"),
}


@pytest.mark.parametrize(("text", "word"), HOSTILE.values(), ids=HOSTILE)
def test_refused_with_a_message(text: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_text(text, encoding="utf-8")
    assert word in refused(load_spec, path)


def test_many_wrong_places_are_told_in_part(tmp_path: Path) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_text(ROBOT + "".join(f"k{k}: 1\n" for k in range(9_000)), encoding="utf-8")
    message = refused(load_spec, path)
    assert "and 8980 more" in message
    assert "k0: unknown key" in message


@pytest.mark.parametrize("grid", ["{step: 1.0e-9}", "{samples: 1000000}", "{step: 1.0e-15}"])
@pytest.mark.parametrize("name", ["cost", "constraints"])
def test_grids_that_fill_the_memory(grid: str, name: str, tmp_path: Path) -> None:
    def built(path: Path) -> None:
        spec = load_spec(path, [f"sampling.{name}={grid}", "trajectory.harmonics=5"])
        with_sampling(spec, build_trajectory(spec.trajectory))

    assert f"sampling.{name}" in refused(built, CONFIG)
