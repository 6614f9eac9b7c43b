"""The tests of the kernels again, on a build that stops at the first wrong access."""

import re
from pathlib import Path

import pytest

from tests.kernels.sanitized import compiled, python, runtime

pytestmark = pytest.mark.skipif(not runtime(), reason="no gcc with AddressSanitizer here")

_TESTS = """
import pytest
sys.exit(pytest.main(["-q", "-x", "-p", "no:cacheprovider", "tests/kernels/test_compiled.py"]))
"""
# One gradient at an instant that there is not: shapes fit, so that the call is let in.
_PLANTED = """
import numpy as np
from excite_cli.kernels.compiled import KERNELS
left, times = np.ones((1, 2)), np.array([{instant}])
KERNELS.call("squared", times, np.ones(1), left, left, np.zeros((3, 2, 2)))
print("ended")
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("sanitized"))


@pytest.mark.long
def test_kernels_are_clean(library: Path) -> None:
    run = python(library, _TESTS)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
    assert " passed" in run.stdout
    assert "skipped" not in run.stdout


@pytest.mark.parametrize(
    ("instant", "told"),
    [
        (3, "AddressSanitizer: heap-buffer-overflow"),
        (2**62, "kernels.c:[0-9]+:[0-9]+: runtime error: signed integer overflow"),
    ],
)
def test_a_planted_fault_is_caught(library: Path, instant: int, told: str) -> None:
    inside = python(library, _PLANTED.format(instant=2))
    assert (inside.returncode, inside.stdout.strip()) == (0, "ended"), inside.stderr
    beyond = python(library, _PLANTED.format(instant=instant))
    assert beyond.returncode != 0
    assert "ended" not in beyond.stdout
    assert re.search(told, beyond.stderr), beyond.stderr[-3000:]
    assert "in squared" in beyond.stderr
