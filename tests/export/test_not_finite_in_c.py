"""What is not finite is a contact in the C file and enters no memory, also with -ffast-math."""

import ctypes
import re
import subprocess
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from excite_cli.effects.catalogue import catalogue
from excite_cli.export.c_model import c_model
from excite_cli.identification.regression import Series
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.scoring.thresholds import Residual
from tests.export.test_c_model import (
    COMPILERS,
    STRICT,
    UR10,
    by_c,
    compiled,
    of_ur10,
    series_of,
    thresholds,
)

pytestmark = pytest.mark.long

LEVELS = [["-O2"], ["-O3", "-ffast-math"], ["-Ofast"]]
BUILDS = list(product(COMPILERS, LEVELS))
NAMED = [f"{compiler} {' '.join(level)}" for compiler, level in BUILDS]
# The last two are finite: their squares, and differences of them, are not.
BAD = [np.nan, np.inf, -np.inf, 1e308, -1e308]
STEP = 0.02


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(UR10)


@pytest.fixture(scope="module", params=BUILDS, ids=NAMED)
def whole(
    request: pytest.FixtureRequest, robot: Robot, tmp_path_factory: pytest.TempPathFactory
) -> ctypes.CDLL:
    """Every effect at once, and a detector."""
    compiler, level = request.param
    text = c_model(*of_ur10(), thresholds=thresholds(robot)).text
    return compiled(text, tmp_path_factory.mktemp("c"), compiler, *level[1:], level=level[0])


class Detector:
    """The C file's, one instant after the other."""

    def __init__(self, library: ctypes.CDLL, n: int, step: float) -> None:
        self.code, self.beyond = library, np.zeros(n)
        self.state = ctypes.create_string_buffer(16 * n + 256)
        self.begin(step)

    def begin(self, step: float) -> None:
        self.code.excite_detector_begin(self.state, ctypes.c_double(step))

    def __call__(self, *rows: Array) -> int:
        given = [np.ascontiguousarray(row) for row in (*rows, self.beyond)]
        pointers = [row.ctypes.data_as(ctypes.c_void_p) for row in given]
        return int(self.code.excite_detect(self.state, *pointers))


class Stepper:
    """`excite_torque`, one instant after the other."""

    def __init__(self, library: ctypes.CDLL, n: int, step: float = STEP, start: float = 0.0):
        self.code, self.tau = library, np.zeros(n)
        self.memory = ctypes.create_string_buffer(8 * 24 * n + 256)
        library.excite_begin.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
        self.begin(step, start)

    def begin(self, step: float, start: float = 0.0) -> None:
        self.code.excite_begin(self.memory, step, start)

    def __call__(self, *rows: Array) -> tuple[int, Array]:
        given = [np.ascontiguousarray(row) for row in (*rows, self.tau)]
        pointers = [row.ctypes.data_as(ctypes.c_void_p) for row in given]
        said = self.code.excite_torque(self.memory, *pointers)
        return int(said), self.tau.copy()


def _rows(series: Series) -> tuple[Array, ...]:
    """q, v, a and the columns of the log, each (T, ·)."""
    columns = np.stack([*series.covariates.values()], axis=1) if series.covariates else None
    room = np.zeros((len(series.t), 1))
    return series.q, series.v, series.a, room if columns is None else columns


def test_detector_hears_after_a_bad_sample(whole: ctypes.CDLL, robot: Robot) -> None:
    rng, given = np.random.default_rng(8), thresholds(robot)
    residual = 0.5 * np.cumsum(rng.normal(0.0, 0.4, (80, robot.n)), axis=0)
    speed, load = rng.normal(0.0, 0.1, (2, 80, robot.n))
    expected = given.beyond(Residual(residual, speed, load, 0.004))
    detector = Detector(whole, robot.n, 0.004)
    bad = list(product(range(3), BAD))
    for k in range(80):
        rows = [residual[k], speed[k], load[k]]
        spoilt = [row.copy() for row in rows]
        which, value = bad[k % len(bad)]
        spoilt[which][:] = value
        assert detector(*spoilt) == 1
        assert np.isfinite(detector.beyond).all()
        assert (np.abs(detector.beyond) > 1.0).all()
        assert detector(*rows) == int((expected[k] > 1.0).any())
        assert np.abs(detector.beyond) == pytest.approx(expected[k], rel=1e-9)
    assert 0.05 < (expected > 1.0).any(axis=1).mean() < 0.95


def test_a_bad_joint_does_not_deafen_the_others(whole: ctypes.CDLL, robot: Robot) -> None:
    detector, still = Detector(whole, robot.n, 0.004), np.zeros(robot.n)
    for value in BAD:
        spoilt = still.copy()
        spoilt[2] = value
        assert detector(spoilt, still, still) == 1
        assert (np.abs(detector.beyond) > 1.0).tolist() == [j == 2 for j in range(robot.n)]
    for j in range(robot.n):
        assert detector(still, still, still) == 0
        assert detector(1e6 * np.eye(robot.n)[j], still, still) == 1
        detector.begin(0.004)
    for step in (*BAD[:3], 0.0, -0.004):
        detector.begin(step)
        assert [detector(still, still, still) for _ in range(3)] == [1, 1, 1], step
        detector.begin(0.004)
        assert [detector(still, still, still) for _ in range(3)] == [0, 0, 0]


@pytest.mark.parametrize("value", BAD)
def test_torque_after_a_bad_sample(whole: ctypes.CDLL, robot: Robot, value: float) -> None:
    rows = _rows(series_of(robot, columns=("temp",)))
    sound, hit = Stepper(whole, robot.n), Stepper(whole, robot.n)
    for k in range(len(rows[0])):
        own = [row[k].copy() for row in rows]
        said, expected = sound(*own)
        assert said == 0
        if k % 10 == 5:
            for which, place in product(range(4), range(robot.n)):
                if which < 3 or place == 0:
                    spoilt = [row.copy() for row in own]
                    spoilt[which][place] = value
                    twin = Stepper(whole, robot.n)
                    twin.memory[:] = hit.memory[:]
                    said, tau = twin(*spoilt)
                    # the square of a position or a column may overflow without the torque
                    assert said == 1
                    assert not np.isfinite(tau).any()
            hit.memory[:] = twin.memory[:]
            continue
        said, tau = hit(*own)
        assert said == 0
        assert np.isfinite(tau).all()
        if k % 10 in (3, 4):  # memories agree again: bristles have moved, differences are filled
            assert tau == pytest.approx(expected, rel=1e-3, abs=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize("step", [*BAD[:3], 0.0, -0.02])
def test_torque_without_a_step(whole: ctypes.CDLL, robot: Robot, step: float) -> None:
    rows = [row[0] for row in _rows(series_of(robot, columns=("temp",)))]
    stepper = Stepper(whole, robot.n, step)
    assert [stepper(*rows)[0] for _ in range(3)] == [1, 1, 1]
    stepper.begin(STEP, step if not np.isfinite(step) else np.nan)
    assert stepper(*rows)[0] == 1
    stepper.begin(STEP)
    assert stepper(*rows)[0] == 0
    assert np.isfinite(stepper(*rows)[1]).all()


def test_no_finite_number_stays_too_large(whole: ctypes.CDLL, robot: Robot) -> None:
    rows = _rows(series_of(robot, columns=("temp",)))
    for exponent in range(10, 308, 6):
        stepper = Stepper(whole, robot.n)
        for k in range(30):
            own = [row[k].copy() for row in rows]
            if k in (5, 6, 7):
                own[2][:] = (-1.0) ** k * 10.0**exponent
            said, tau = stepper(*own)
            assert bool(said) != np.isfinite(tau).all()
            assert not said or 5 <= k <= 9, (exponent, k)


def test_load_says_what_is_not_finite(whole: ctypes.CDLL, robot: Robot) -> None:
    rows, tau = [row[3].copy() for row in _rows(series_of(robot))[:3]], np.zeros(robot.n)
    for which, value in product(range(3), [0.0, *BAD]):
        own = [row.copy() for row in rows]
        own[which][robot.n - 1] = value
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (*own, tau)]
        assert whole.excite_load(*pointers) == int(value != 0.0)
        assert np.isfinite(tau).all() == (value == 0.0)


@pytest.mark.parametrize("value", BAD)
def test_series_with_bad_instants(whole: ctypes.CDLL, robot: Robot, value: float) -> None:
    series = series_of(robot, count=200, columns=("temp",))
    clean, bad = by_c(whole, series), [0, 50, 51, 100, 199]
    for which in range(4):
        rows = [row.copy() for row in _rows(series)]
        for k in bad:
            rows[which][k, 0] = value
        spoilt = Series(series.t, *rows[:3], series.run, series.start, {"temp": rows[3][:, 0]})
        found = by_c(whole, spoilt)
        assert [k for k in range(200) if not np.isfinite(found[k]).all()] == bad
        assert [k for k in range(200) if np.isnan(found[k]).any()] == bad
        near = np.zeros(200, dtype=bool)
        for k in bad:  # differences are one-sided there, and a flight ends
            near[max(0, k - 25) : k + 25] = True
        assert found[~near] == pytest.approx(clean[~near], abs=1e-3 * np.abs(clean).max())


@pytest.mark.parametrize("kind", sorted(catalogue()))
def test_every_effect_alone_comes_back(kind: str, tmp_path: Path) -> None:
    robot, model = of_ur10([kind])
    columns = ("temp",) if model.effects[0].follows_covariate else ()
    rows = _rows(series_of(robot, columns=columns))
    text, flags = c_model(robot, model).text, ("-ffast-math",)
    assert re.search(r"What is not finite(?s:.)*is a contact", text[: text.index("*/")])
    library = compiled(text, tmp_path, COMPILERS[0], *flags, level="-O3")
    for value in BAD:
        sound, hit = Stepper(library, robot.n), Stepper(library, robot.n)
        for k in range(len(rows[0])):
            own = [row[k].copy() for row in rows]
            expected = sound(*own)[1]
            if k in (0, 20, 21):
                own[k % 3][:] = value
            said, tau = hit(*own)
            assert said == int(k in (0, 20, 21))
            assert np.isfinite(tau).all() != bool(said)
        assert tau == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("flags", [(), ("-DEXCITE_FLOAT",)], ids=["double", "float"])
@pytest.mark.parametrize("level", LEVELS, ids=lambda level: " ".join(level))
@pytest.mark.parametrize("deaf", ["", "all_finite", "rated"])
def test_the_file_tests_it_itself(
    deaf: str, level: list[str], flags: tuple[str, ...], robot: Robot, tmp_path: Path
) -> None:
    _, model = of_ur10(["viscous_friction", "dahl_friction", "covariate_friction"])
    text = c_model(robot, model, thresholds=thresholds(robot)).text
    if deaf == "all_finite":
        text = text.replace("if ((each.all & EXPONENT) >= SQUARES)", "if (each.all == 1)")
    elif deaf == "rated":
        text = text.replace("memory->rated = 0;", "*memory = *ahead;")
        text = text.replace("if (!memory->usable || !given(q, v, a, column))", "if (0)")
    source, program = tmp_path / "model.c", tmp_path / "model"
    source.write_text(text, encoding="utf-8")
    command = [COMPILERS[0], *STRICT, *level, *flags, "-DEXCITE_MAIN", "-DEXCITE_CALLS=500"]
    subprocess.run([*command, str(source), "-o", str(program), "-lm"], check=True)
    ran = subprocess.run([str(program)], capture_output=True, text=True)
    assert (ran.returncode == 0) == (deaf == ""), ran.stdout
