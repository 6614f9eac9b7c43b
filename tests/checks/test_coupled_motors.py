"""A wrist whose motors are coupled, logged at the joints and at the motors."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.api.loading import load_case, load_data
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.simulation.ground_truth import plant
from tests.checks.test_set_up_search import changed, declaring, found
from tests.simulation.arms import arm, played

pytest.importorskip("mujoco")
pytestmark = pytest.mark.long

FIRST, SECOND = 4, 5
WRISTS = ("wrist_2_joint", "wrist_3_joint")


@pytest.fixture(scope="module")
def smooth() -> Dataset:
    """Without friction of the last joint."""
    rubs = [plant(kind_named("coulomb_friction"), (j,), x) for j, x in enumerate([9, 9, 6, 2, 1.0])]
    return played(arm(), *rubs, torque_noise=0.01, inertia_error=0.2).dataset


def rubbing(data: Dataset, way: float, at_joints: bool) -> Dataset:
    """The last motor turns with v_k + way · v_j, and rubs."""

    def more(run: Run) -> Run:
        assert run.dq is not None
        turn = run.dq[:, SECOND] + way * run.dq[:, FIRST]
        rubs, tau = 2.0 * np.tanh(turn / 0.01) + 1.5 * turn, run.tau.copy()
        tau[:, SECOND] += rubs
        tau[:, FIRST] += way * rubs if at_joints else -way * (tau[:, SECOND] - rubs)
        return replace(run, tau=tau)

    return changed(data, more)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_torques_of_motors_are_told_with_the_key_that_undoes_the_coupling(
    smooth: Dataset, way: float
) -> None:
    """τ_motor of the first is τ_joint less what the second's motor gives it."""
    at_motors = rubbing(smooth, way, at_joints=False)
    (result,) = (each for each in found(at_motors) if each.kind == "coupling")
    assert result.status == "doubt"
    assert result.settings == {"measurement.coupling": {WRISTS[0]: {WRISTS[1]: way}}}
    assert "are those of their motors: the friction of wrist_3_joint follows" in result.evidence
    told = declaring(coupling={WRISTS[0]: {WRISTS[1]: way}})
    assert all(each.kind != "coupling" for each in found(at_motors, told)), "it is declared"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_friction_of_coupled_gears_in_torques_of_joints_is_no_such_doubt(
    smooth: Dataset, way: float
) -> None:
    at_joints = rubbing(smooth, way, at_joints=True)
    assert all(each.kind != "coupling" for each in found(at_joints))


def test_a_real_wrist_is_told_from_the_torques_of_its_motors() -> None:
    """A Stäubli TX40, whose authors undid the coupling: τ_5 = m_5 + m_6."""
    folder = Path(__file__).resolve().parents[2] / "data" / "tx40"
    case = load_case(folder / "tx40.yaml")
    data = load_data(case, folder / "tx40.h5")
    with h5py.File(folder / "tx40.h5") as file:
        motors = np.array(file["runs/excite/tau_motor"]) * file.attrs["gear_ratios"]
    assert not [each for each in found(data, case.spec, case.robot) if each.kind == "coupling"]
    at_motors = changed(data, lambda run: replace(run, tau=motors))
    (result,) = (
        each for each in found(at_motors, case.spec, case.robot) if each.kind == "coupling"
    )
    assert result.settings == {"measurement.coupling": {"joint_5": {"joint_6": 1.0}}}
