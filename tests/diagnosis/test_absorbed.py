"""Effects that are hidden in inertial parameters, on robots where mechanics says so."""

import numpy as np

from excite_cli.config.load_spec import load_spec
from excite_cli.diagnosis.aliases import absorbed_effects
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.records import ConfoundedCandidate
from excite_cli.diagnosis.schur import ABSORBED
from excite_cli.diagnosis.training import TrainingData
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.armature import Armature
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.spring import Spring
from excite_cli.effects.torque_offset import TorqueOffset
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.identification.regression import signals_of
from excite_cli.robot.model import build_robot
from tests.cli.program import SMOKE
from tests.identification.synthetic import measured, regression_of

# A chain whose first joint turns about a vertical axis, z of its link.
ROBOT = build_robot(load_spec(SMOKE).robot, SMOKE.parent)


def absorbed(
    effects: list[Effect], chosen: tuple[int, ...] = ()
) -> dict[tuple[str, str], ConfoundedCandidate]:
    """By kind and joint, for a lively motion."""
    dataset = measured(ROBOT, standard_parameters(ROBOT), noise=0.1, seconds=8.0)
    found = regression_of(ROBOT, dataset)
    candidates = []
    for effect in effects:
        blocks = []
        for run in found.runs:
            signals = signals_of(run.prepared, ROBOT)
            blocks.append(
                run.prepared.averaged_for_fit(effect.columns(signals), effect.rows(ROBOT.n))
            )
        candidates.append(Candidate(effect, effect.rows(ROBOT.n), tuple(blocks)))
    data = TrainingData(
        tuple(run.prepared for run in found.runs),
        (0, 1),
        tuple(run.inertial for run in found.runs),
        tuple(run.tau for run in found.runs),
    )
    evidence = data.evidence(candidates, NoiseModel.white(np.ones(ROBOT.n)))
    records = absorbed_effects(
        evidence, candidates, chosen, DeclaredModel(ROBOT, found.base, (), None)
    )
    return {(each.kind, each.joints[0]): each for each in records}


def in_proportion(factor: float) -> Effect:
    """To the speed of the second joint."""

    class Proportional(Armature):
        kind = "proportional"

        def columns(self, signals):  # type: ignore[no-untyped-def]
            return factor * signals.v[:, list(self.joints), None]

    return Proportional((1,))


def test_what_absorbs_an_effect() -> None:
    """Izz of link k has the column I_a a_k while what comes before turns about other axes.

    So for the first joint, and for the second whose axis is at right angles; not for the third,
    which is parallel to the second: there Izz shows in both rows.
    """
    found = absorbed([Armature((j,)) for j in range(3)])
    first, second, _ = ROBOT.joint_names[:3]
    assert set(found) == {("armature", first), ("armature", second)}
    for each in found.values():
        assert all(name.startswith("I") for name in each.by)
        assert each.left < ABSORBED
    # What a found effect absorbs is named after it. A second effect of the same form is absorbed by
    # the one in the model, not by an inertia.
    viscous, same = ViscousFriction((1,)), in_proportion(3.0)
    assert absorbed([viscous, same]) == {}
    found = absorbed([viscous, same], chosen=(0,))
    assert found["proportional", ROBOT.joint_names[1]].by == (f"viscous[{ROBOT.joint_names[1]}]",)


def test_what_is_not_absorbed() -> None:
    effects: list[Effect] = [ViscousFriction((0,)), CoulombFriction((1,)), TorqueOffset((2,))]
    assert absorbed(effects) == {}

    assert absorbed([in_proportion(0.0)]) == {}, "what does not show at all is not absorbed"
    # Refinements, runs and chosen places are left out.
    effects = [
        Armature((0,), {}, ("r1",)),
        NonlinearViscousFriction((0,), {"power": 2.0}),
        Spring((0,)),
    ]
    assert ("armature", ROBOT.joint_names[0]) not in absorbed(effects)
    assert absorbed([Armature((0,))], chosen=(0,)) == {}
