"""A fit that its motions do not determine is told, and that kept inertias are better, in MuJoCo."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.diagnosis.answer_words import answer_in_words
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.overfit import is_overfit, overfit_in_words
from excite_cli.diagnosis.records import Diagnosis, Overfit
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.robot.model import build_robot
from tests.cli.program import SMOKE
from tests.diagnosis.synthetic_diagnosis import make_diagnosis

pytest.importorskip("mujoco")

from excite_cli.simulation.planted import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.test_changes import ELBOW, motion


@pytest.fixture(scope="module")
def timid() -> Diagnosis:
    """Two runs that hardly move, and a sealed one that does; Coulomb friction on the elbow.

    No joint stands still in them: where one does, inertias are kept from the start.
    """
    spec = load_spec(
        SMOKE,
        [
            "diagnosis.kinds=[viscous_friction,coulomb_friction]",
            "identification.inertias=free",
        ],
    )
    robot = build_robot(spec.robot, SMOKE.parent)
    motions = []
    hardly = 0.06 * np.append(np.ones(robot.n - 1), 6.0)
    for number, scale in ((1, hardly), (2, hardly), (3, np.ones(robot.n))):
        whole = motion(robot, number)
        coefficients = whole.coefficients.copy()
        coefficients[:-1] *= scale
        motions.append(replace(whole, coefficients=coefficients))
    settings = SimulationSettings(rate=100.0, lead_in=0.5, torque_noise=0.02, inertia_error=0.05)
    rubbing = [plant(kind_named("coulomb_friction"), (ELBOW,), 2.0)]
    data = simulate(robot, motions, settings, rubbing).dataset
    return diagnose(robot, find_base_parameters(robot), data, spec)


def test_a_fit_that_is_worse_than_the_urdf_is_told_and_kept_inertias_are_tried(
    timid: Diagnosis,
) -> None:
    found = timid.overfit
    assert found is not None
    assert found.untouched is not None
    assert found.kept is not None
    assert found.training < 0.05 < found.untouched < found.sealed
    assert found.kept < 0.03
    assert found.sealed == timid.after.mean_relative_moving
    told = answer_in_words(timid)
    assert told.startswith("Overfit: the model leaves ")
    assert "more than the URDF with nothing fitted" in told
    assert "identification.inertias: cad" in told


@pytest.mark.parametrize(
    ("training", "sealed", "untouched", "overfit"),
    [
        (0.02, 0.05, 0.9, False),
        (0.02, 0.21, 0.9, True),
        (0.005, 0.04, 0.9, False),  # it is good
        (0.1, 0.3, 0.25, True),
        (0.1, 0.3, None, False),
    ],
)
def test_by_which_errors(
    training: float, sealed: float, untouched: float | None, overfit: bool
) -> None:
    plain = make_diagnosis()
    before, after = plain.before, replace(plain.after, mean_relative_moving=sealed)
    found = replace(
        plain,
        after=after,
        trained=replace(after, mean_relative_moving=training),
        untouched=None if untouched is None else replace(before, mean_relative_moving=untouched),
    )
    assert is_overfit(found, "free") == overfit
    assert not is_overfit(found, "cad")
    assert not is_overfit(replace(found, trained=None), "free")


def test_what_to_do_depends_on_what_helps() -> None:
    plain = Overfit(0.01, 0.2, None, None)
    assert overfit_in_words(plain).endswith("Record motions that excite more (`excite optimize`).")
    assert "set that" in overfit_in_words(replace(plain, kept=0.1))
    assert "does not help (19%)" in overfit_in_words(replace(plain, kept=0.19))
    assert "more than the URDF" not in overfit_in_words(replace(plain, untouched=0.3))
