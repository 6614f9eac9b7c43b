"""What a simulator has no place for is left out of a diagnosis, and the rest fitted again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import diagnose, identify, load_case, load_problem, plan, simulate
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.reduced_model import ReducedModel, reduced_model
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.base import Effect
from excite_cli.errors import FileError
from excite_cli.export.mjcf import holds
from excite_cli.robot.model import Array, Robot

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
SMALL = [
    "constraints={}", "robot.joints=[elbow, slide]", "optimizer.max_iterations=5",
    "sequence.motions=2",
]  # fmt: skip
STRAIGHT = "{kind: viscous_friction}, {kind: coulomb_friction}"
WAVE = "{kind: position_friction, joints: [elbow], shape: {periods: 1, power: 0}}"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two joints whose elbow has friction that changes over the turn."""
    folder = tmp_path_factory.mktemp("reduced")
    problem = load_problem(CONFIG, SMALL)
    plan(problem, output=folder / "arm.h5")
    planted = ["coulomb_friction@elbow=4", "position_friction@elbow=3,periods:1,power:0"]
    simulate(problem, folder / "arm.h5", planted, output=folder / "log.h5")
    return folder / "log.h5"


def diagnosed(log: Path, effects: str) -> tuple[Diagnosis, Robot]:
    case = load_case(CONFIG, [*SMALL, f"effects=[{effects}]", "diagnosis.rounds=0"])
    return diagnose(case, log), case.robot


def of_kinds(reduced: ReducedModel) -> dict[tuple[str, tuple[int, ...]], Array]:
    return {(effect.kind, effect.joints): x for effect, x in reduced.estimate.by_effect}


def test_the_rest_makes_up_for_what_is_lost(log: Path) -> None:
    """The elbow's straight friction takes the wave; all else stays near what was found."""
    found, robot = diagnosed(log, f"{STRAIGHT}, {WAVE}")
    reduced = reduced_model(found, robot, holds)
    assert reduced is not None
    assert [effect.kind for effect in reduced.dropped] == ["position_friction"]
    base = find_base_parameters(robot)
    whole = {(r.kind, *r.joints): r.values[0] for r in found.declared}
    elbow, slide = (robot.joint_names.index(name) for name in ("elbow", "slide"))
    taken = of_kinds(reduced)["coulomb_friction", (elbow,)][0]
    assert abs(taken - whole["coulomb_friction", "elbow"]) > 0.2
    other = of_kinds(reduced)["viscous_friction", (slide,)][0]
    assert other == pytest.approx(whole["viscous_friction", "slide"], abs=0.05)
    # The gradient of both terms, with M from the covariance of what keeps its name.
    factor, rank = found.information.factor, base.rank
    told = np.append(base.mapping @ found.phi, [x for r in found.declared for x in r.values])
    kept = len(told) - 2  # the wave is declared last
    at_elbow = [rank + k for k, r in enumerate(found.declared[:-1]) if r.joints == ("elbow",)]
    named = [k for k in range(kept) if k not in at_elbow]
    covariance = np.linalg.inv(factor[:, : len(told)].T @ factor[:, : len(told)])
    y = np.append(base.mapping @ reduced.estimate.phi, reduced.estimate.values)
    pulled = np.zeros(kept)
    pulled[named] = np.linalg.solve(covariance[np.ix_(named, named)], (y - told[:kept])[named])
    rows = factor[:, :kept]
    missed = rows.T @ (rows @ y - factor[:, : len(told)] @ told) / 9.0
    np.testing.assert_allclose(pulled + missed, 0.0, atol=1e-6 * np.abs(missed).max())


def test_nothing_changes_where_all_is_held(log: Path) -> None:
    found, robot = diagnosed(log, STRAIGHT)
    reduced = reduced_model(found, robot, holds)
    assert reduced is not None
    base = find_base_parameters(robot)
    np.testing.assert_allclose(base.mapping @ reduced.estimate.phi, base.mapping @ found.phi)
    told = [value for record in found.declared for value in record.values]
    np.testing.assert_allclose(reduced.estimate.values, told, rtol=1e-9, atol=1e-12)
    assert np.linalg.eigvalsh(reduced.factor.T @ reduced.factor).min() > 0


def test_friction_that_was_tested_joins_on_joints_that_lose_an_effect(log: Path) -> None:
    found, robot = diagnosed(log, f"{STRAIGHT}, {WAVE}")
    known, rank = found.information, find_base_parameters(robot).rank
    dry = [r for r in found.declared if r.kind == "coulomb_friction"]
    rest = tuple(r for r in found.declared if r not in dry)
    order = [*range(rank), *(rank + np.array([0, 1, 4, 5])), *(rank + np.array([2, 3]))]
    without = replace(
        found,
        declared=rest,
        information=replace(known, factor=known.factor[:, order], model=rest, possible=tuple(dry)),
    )
    reduced = reduced_model(without, robot, holds)
    assert reduced is not None
    elbow, slide = (robot.joint_names.index(name) for name in ("elbow", "slide"))
    assert of_kinds(reduced)["coulomb_friction", (elbow,)][0] > 0.1
    assert ("coulomb_friction", (slide,)) not in of_kinds(reduced)

    def no_dry_friction(effect: Effect, values: Array) -> bool:
        return effect.kind != "coulomb_friction" and holds(effect, values)

    never = reduced_model(without, robot, no_dry_friction)
    assert never is not None
    assert ("coulomb_friction", (elbow,)) not in of_kinds(never)


def test_effects_that_a_refit_turns_are_left_out_too(log: Path) -> None:
    """A simulator that has friction below a size only: it goes as soon as it grows beyond."""
    found, robot = diagnosed(log, f"{STRAIGHT}, {WAVE}")
    size = next(r.values[0] for r in found.declared if r.kind == "coulomb_friction")

    def small(effect: Effect, values: Array) -> bool:
        return effect.kind != "position_friction" and bool((values <= size + 0.1).all())

    reduced = reduced_model(found, robot, small)
    assert reduced is not None
    assert all(small(effect, values) for effect, values in reduced.model.by_effect)


def test_it_is_what_identify_finds(log: Path) -> None:
    found, robot = diagnosed(log, f"{STRAIGHT}, {WAVE}")
    reduced = reduced_model(found, robot, holds)
    assert reduced is not None
    case = load_case(CONFIG, [*SMALL, f"effects=[{STRAIGHT}]"])
    fit = identify(case, log).fit
    mine = dict(zip([e.place for e in reduced.model.effects], reduced.model.values, strict=True))
    other = dict(zip([e.place for e in fit.effects], fit.best_model.values, strict=True))
    assert mine.keys() == other.keys()
    for place, value in other.items():
        assert mine[place] == pytest.approx(value, rel=0.1, abs=0.05), place


def test_a_covariance_of_other_effects_is_refused(log: Path) -> None:
    found, robot = diagnosed(log, STRAIGHT)
    known = found.information
    short = replace(found, information=replace(known, factor=known.factor[:, :-1]))
    other = replace(found, information=replace(known, model=known.model[1:]))
    for edited in (short, other):
        with pytest.raises(FileError, match=r"^d\.h5: its covariance is of other effects than"):
            reduced_model(edited, robot, holds, Path("d.h5"))
