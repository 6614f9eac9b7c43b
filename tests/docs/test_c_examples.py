"""The C of docs/how-to/predict.md compiles and does what the page says of it."""

import ctypes
import re
import subprocess

import numpy as np
import pytest

from excite_cli.api.model import Model
from excite_cli.export.c_model import c_model
from excite_cli.robot.model import Array
from excite_cli.scoring.validity import Trust
from tests.cli.program import ROOT
from tests.export.test_c_model import COMPILERS, STRICT, of_ur10
from tests.export.test_std_in_c import by_c, stored

KINDS = ["viscous_friction", "load_dependent_friction", "coulomb_friction", "spring", "payload"]


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(stored(*of_ur10(KINDS)))


@pytest.fixture(scope="module")
def library(model: Model, tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("c")
    page = (ROOT / "docs" / "how-to" / "predict.md").read_text(encoding="utf-8")
    header, *examples = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    assert len(examples) == 2
    made = model.made
    own = c_model(made.robot, made.model, trust=Trust(made)).text
    # With the header before it, a compiler sees that both declare the same.
    texts = {"arm.h": header, "arm.c": f'#include "arm.h"\n{own}'}
    texts |= {f"example_{k}.c": text for k, text in enumerate(examples)}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = [str(folder / name) for name in texts if name.endswith(".c")]
    command = [COMPILERS[0], *STRICT, "-O2", "-fPIC", "-shared", *sources]
    subprocess.run([*command, "-o", str(folder / "arm.so"), "-lm"], check=True)
    return ctypes.CDLL(str(folder / "arm.so"))


@pytest.fixture(scope="module")
def states(model: Model) -> tuple[Array, Array, Array]:
    return model.made.robot.draw_states(20, seed=8)


def test_gravity_is_compensated_and_friction_fed_forward(
    model: Model, library: ctypes.CDLL, states: tuple[Array, Array, Array]
) -> None:
    q, v, _ = states
    still = np.zeros_like(q)
    gravity, friction = model.torque(q, still, still), model.friction(q, v)
    assert np.abs(friction).max() > 1.0
    found = by_c(library, "feed_forward", q, v)
    assert found == pytest.approx(gravity + friction, rel=1e-9, abs=1e-9)
    by_c(library, "feed_forward", q, np.full_like(v, np.nan), back=1)


def test_a_residual_is_judged_by_the_standard_deviation(
    model: Model, library: ctypes.CDLL, states: tuple[Array, Array, Array]
) -> None:
    tau, std = model.torque(*states, std=True)
    library.surprised.argtypes = [*[ctypes.c_void_p] * 4, ctypes.c_double]

    def surprised(k: int, measured: Array) -> int:
        rows = [np.ascontiguousarray(x) for x in (*(x[k] for x in states), measured)]
        return int(library.surprised(*(x.ctypes.data_as(ctypes.c_void_p) for x in rows), 4.0))

    for k in range(len(tau)):
        one = np.eye(6)[k % 6] * std[k]
        assert surprised(k, tau[k] + 3.99 * one) == 0
        assert surprised(k, tau[k] - 4.01 * one) == 1
        assert surprised(k, tau[k] + np.nan * one) == 1


def test_functions_of_the_header_say_what_python_says(
    model: Model, library: ctypes.CDLL, states: tuple[Array, Array, Array]
) -> None:
    tau, std = model.torque(*states, std=True)
    assert by_c(library, "excite_state", *states) == pytest.approx(tau, rel=1e-9, abs=1e-9)
    assert by_c(library, "excite_std", *states) == pytest.approx(std, rel=1e-9)
