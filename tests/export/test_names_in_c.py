"""No name ends a comment of the C file, begins one, or makes a compiler speak."""

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.export.c_model import c_model
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import build_robot
from tests.export.test_c_model import COMPILERS, STRICT, UR10

HOSTILE = [
    "a*/ b",
    "*/ int x; /*",
    "/*",
    "/*/*/**//",
    "*",
    "/",
    "ends in \\",
    "two\\\nlines */",
    "*\\\n/ #error",
    "new\nline",
    "return\rvertical\vform\f",
    "*??/\n/",
    "???/",
    "// ??/",
    "// \\",
    "null\0inside",
    "тело 関節 Gelenk\u00a0ä",
    "turned \u202e \u2066 round",
    "line\u2028separator\u0085",
    "half \ud800",
    '"; #include "/etc/passwd',
    "@TREE@ @N@",
    "%s%n",
]
LANGUAGES = ["-std=c99", "-std=c11", "-std=gnu17", "-trigraphs"]


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("language", LANGUAGES)
def test_hostile_names_are_inert(compiler: str, language: str, tmp_path: Path) -> None:
    for shift in range(0, len(HOSTILE), 6):
        text = _text_with([HOSTILE[(shift + k) % len(HOSTILE)] for k in range(6)])
        source = tmp_path / "model.c"
        source.write_text(text, encoding="utf-8")
        strict = [*STRICT, "-Wall", "-Wtrigraphs", language]
        command = [compiler, *strict, "-c", str(source), "-o", str(tmp_path / "model.o")]
        built = subprocess.run(command, capture_output=True, text=True)
        assert built.returncode == 0, built.stderr
        assert not built.stderr


def _text_with(names: list[str]) -> str:
    """Names of the robot, of joints, of a column of the log, and where the model comes from."""
    robot = build_robot(UR10)
    description = replace(robot.description, name=names[0])
    robot = replace(robot, name=names[0], joint_names=tuple(names), description=description)
    effects = [kind_named("spring")((j,)) for j in range(robot.n)]
    column = names[1] or "temp"
    kind = kind_named("covariate_friction")
    effects.append(kind((1,), {"reference": 20.0}, (), column))
    values = np.ones(sum(len(effect.parameters) for effect in effects))
    model = IdentifiedModel(standard_parameters(robot), tuple(effects), values)
    return c_model(robot, model, made=names[2]).text


def test_ordinary_names_stand_as_they_are() -> None:
    names = ["axis_1", "left/arm", "Gelenk ä", "joint-3 (wrist)", "a*b", "関節"]
    text = _text_with(names)
    assert text.startswith("/* axis_1: joint torques of an identified model. Gelenk ä\n")
    for k, name in enumerate(names):
        assert f" *   {k} {name}\n" in text
