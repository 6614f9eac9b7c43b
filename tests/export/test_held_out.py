"""What an exported model leaves of the torque on held-out data, beside the URDF as given."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import export_file
from excite_cli.api.exporting import Exported, export_answer
from excite_cli.effects.armature import Armature
from excite_cli.effects.catalogue import straight_friction
from excite_cli.effects.torque_offset import TorqueOffset
from excite_cli.export import mjcf, urdf
from excite_cli.export.held_out import HeldOutErrors, held_out_errors, torque_left
from excite_cli.identification.identified_model import IdentifiedModel, as_described
from excite_cli.identification.regression import Series
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array, Robot
from tests.api.conftest import Loop
from tests.api.conftest import loop as loop
from tests.export.drives import ur10


@pytest.fixture(scope="module")
def robot() -> Robot:
    return ur10()


def trace_of(robot: Robot, model: IdentifiedModel, held_out: bool = True) -> TorqueTrace:
    q, v, a = robot.draw_states(200, seed=3)
    t = 0.01 * np.arange(200.0)
    torque = model.predicted(robot, Series(t, q, v, a)).torque
    every = np.ones_like(q, dtype=bool)
    return TorqueTrace("run", held_out, t, q, v, a, torque, torque, every, 0.9 * torque)


def test_shares_are_by_their_definition(robot: Robot) -> None:
    described = as_described(robot)
    assert described is not None
    j = robot.n - 1
    effects = (*straight_friction(j), Armature((j,)), TorqueOffset((j,)))
    true = IdentifiedModel(described.phi, effects, np.array([2.0, 5.0, 0.3, 4.0]))
    trace = trace_of(robot, true)

    def share(torque: Array) -> float:
        squares = np.square(trace.measured - torque).sum(axis=0)
        return float(np.sqrt(squares / np.square(trace.measured).sum(axis=0)).mean())

    both = [trace, trace_of(robot, described, held_out=False)]
    of_mjcf = held_out_errors(robot, both, true, mjcf.holds, described)
    of_urdf = held_out_errors(robot, both, true, urdf.holds, described)
    assert of_mjcf is not None
    assert of_urdf is not None
    assert of_mjcf.file == pytest.approx(0.0, abs=1e-12)
    assert of_mjcf.model == pytest.approx(0.1)
    motion = Series(trace.t, trace.q, trace.v, trace.a)
    before = share(described.predicted(robot, motion).torque)
    assert of_mjcf.described == pytest.approx(before)
    without = true.without((effects[2],))
    assert of_urdf.file == pytest.approx(share(without.predicted(robot, motion).torque))
    lacking = trace.measured - without.predicted(robot, motion).torque
    left = torque_left(robot, both, true, urdf.holds)
    assert left == pytest.approx(np.sqrt(np.mean(lacking**2, axis=0)))
    assert not of_mjcf.worse
    assert replace(of_mjcf, file=before).worse
    assert not replace(of_mjcf, file=9.0, described=None).worse


def test_without_held_out_samples_nothing_is_said(robot: Robot) -> None:
    described = as_described(robot)
    assert described is not None
    trained = trace_of(robot, described, held_out=False)
    assert held_out_errors(robot, [trained], described, mjcf.holds, described) is None
    few = trace_of(robot, described)
    few = replace(few, counted=few.counted & (np.arange(200) < 5)[:, None])
    assert held_out_errors(robot, [few], described, mjcf.holds, described) is None
    for known in ([trained], [few]):
        assert np.isnan(torque_left(robot, known, described, mjcf.holds)).all()


def test_a_file_that_is_worse_is_said_first() -> None:
    bad = Exported("mjcf", (Path("arm.xml"),), held_out=HeldOutErrors("b", 0.6, 0.2, 0.5))
    answer = export_answer(bad)
    assert not answer.good
    assert str(answer.parts[0]).startswith(
        "arm.xml predicts no better than the URDF as given: do not use it. On the held-out data "
        "(b) it leaves 60.00% of torque RMS"
    )
    assert answer.data["held_out"] == {"run": "b", "file": 0.6, "model": 0.2, "urdf": 0.5}
    good = export_answer(replace(bad, held_out=HeldOutErrors("b", 0.3, 0.2, None)))
    assert good.good
    assert good.parts[0] == "arm.xml"
    assert "URDF" not in str(good.parts[1])


def test_a_fit_knows_what_its_file_leaves(loop: Loop, tmp_path: Path) -> None:
    found = export_file(loop.fit, "mjcf", tmp_path / "arm.xml").held_out
    assert found is not None
    assert found.described is not None
    assert found.file < found.described
    assert export_file(loop.fit, "c", tmp_path / "arm.c").held_out is None
