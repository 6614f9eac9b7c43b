"""An effect of a package of one's own: planted in MuJoCo, named, and judged by its own traits.

It is the one that docs/how-to/effect.md writes, installed as its readers do.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, catalogue, kind_named
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Robot, build_robot
from tests.cli.program import SMOKE
from tests.diagnosis.test_held_out import motion
from tests.effects import own_package

pytest.importorskip("mujoco")

from excite_cli.simulation.build import assemble
from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

OWN = "roller_friction"
RIVALS = ("viscous_friction", "coulomb_friction", "asymmetric_friction", "spring")
ELBOW = 2
Named = dict[str, tuple[float, ...]]


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[type[Effect]]:
    """The class, once its package is installed."""
    folder = tmp_path_factory.mktemp("package")
    own_package.install(folder, own_package.code(), own_package.points())
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.delitem(sys.modules, own_package.MODULE, raising=False)
        catalogue.cache_clear()
        yield kind_named(OWN)
    catalogue.cache_clear()


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(load_spec(SMOKE).robot, SMOKE.parent)


@pytest.fixture(scope="module")
def planted(own: type[Effect]) -> tuple[Planted, ...]:
    """Friction on three rollers beside viscous and Coulomb friction."""
    friction = {"viscous_friction": 4.0, "coulomb_friction": 2.0}
    plain = (plant(kind_named(kind), (ELBOW,), size) for kind, size in friction.items())
    return (*plain, plant(own, (ELBOW,), 3.0, {"sin": -1.5}))


@pytest.fixture(scope="module")
def data(robot: Robot, planted: tuple[Planted, ...]) -> Dataset:
    return played(robot, planted)


def played(robot: Robot, planted: tuple[Planted, ...]) -> Dataset:
    motions = [motion(robot, number) for number in (1, 2, 3)]
    return simulate(robot, motions, SimulationSettings(rate=200.0, lead_in=0.5), planted).dataset


@pytest.fixture(scope="module")
def named(robot: Robot, data: Dataset) -> Callable[..., Named]:
    """What a diagnosis names on the elbow, with values; elsewhere only what every robot has."""
    base = find_base_parameters(robot)

    def run(*kinds: str) -> Named:
        chosen = f"[{','.join(kinds)}]" if kinds else "all"
        found = diagnose(robot, base, data, load_spec(SMOKE, [f"diagnosis.kinds={chosen}"]))
        own = [each for each in found.effects if each.effect.joints == ("elbow",)]
        others = {each.effect.kind for each in found.effects if each not in own}
        assert others <= {*EVERYDAY_FRICTION, *EVERYDAY}
        return {
            each.effect.kind: tuple(value.value for value in each.parameters.values())
            for each in own
        }

    return run


def test_it_is_found_under_its_own_name_among_all_kinds(named: Callable[..., Named]) -> None:
    found = named()
    assert set(found) == {OWN, "viscous_friction", "coulomb_friction"}
    assert found[OWN] == pytest.approx((3.0, -1.5), rel=0.03)
    assert found["coulomb_friction"] == pytest.approx((2.0,), rel=0.03)


@pytest.mark.parametrize(
    ("trait", "value"),
    [
        ("prior_cost", 1e9),
        ("possible", lambda self, values: float(np.hypot(*values)) < 1.0),
    ],
)
def test_a_price_or_a_limit_of_its_own_keeps_it_out(
    trait: str,
    value: Any,
    own: type[Effect],
    named: Callable[..., Named],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(own, trait, value)
    assert OWN not in named(*RIVALS, OWN)


def test_what_its_parameters_may_be_keeps_it_out(
    own: type[Effect], named: Callable[..., Named], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = own.parameters
    assert OWN in named("viscous_friction", OWN)
    monkeypatch.setattr(own, "parameters", (replace(first, believed=(-1.0, 1.0)), second))
    assert OWN not in named("viscous_friction", OWN)
    monkeypatch.setattr(own, "parameters", (first, replace(second, nonnegative=True)))
    assert OWN not in named("viscous_friction", OWN)


def test_what_it_excludes_is_not_named_beside_it(
    own: type[Effect], named: Callable[..., Named], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert set(named(*RIVALS, OWN)) >= {OWN, "viscous_friction"}
    monkeypatch.setattr(own, "excludes", ("viscous_friction",))
    assert len(set(named(*RIVALS, OWN)) & {OWN, "viscous_friction"}) == 1


def test_its_mechanism_is_in_the_simulated_robot(
    own: type[Effect],
    robot: Robot,
    planted: tuple[Planted, ...],
    data: Dataset,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    build = assemble(robot, standard_parameters(robot), "run", planted)
    assert [each.effect.kind for each in build.looped] == [OWN]
    assert OWN not in [each.effect.kind for each in build.compensated]
    monkeypatch.setattr(own, "build_into", lambda self, robot, values, numbers: None)
    without, rest = played(robot, planted), played(robot, planted[:2])
    for one, other, there in zip(without.runs, rest.runs, data.runs, strict=True):
        assert np.array_equal(one.tau, other.tau)
        assert np.abs(there.tau - one.tau)[:, ELBOW].max() > 2.0
