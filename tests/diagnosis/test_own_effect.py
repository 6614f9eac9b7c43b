"""An effect of a package of one's own: planted in MuJoCo, named, and judged by its own traits.

It is the one that docs/how-to/effect.md writes, installed as its readers do.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import EFFECTS, EVERYDAY, EVERYDAY_FRICTION, kind_named
from excite_cli.measurement.dataset import Dataset
from tests.diagnosis.simulated_arm import ELBOW, ROBOT, PlantedEffect, planted, played, told
from tests.effects import own_package
from tests.registries import forget

pytestmark = pytest.mark.long

OWN = "roller_friction"
RIVALS = ("viscous_friction", "coulomb_friction", "asymmetric_friction", "spring")
Named = dict[str, tuple[float, ...]]


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[type[Effect]]:
    """The class, once its package is installed."""
    folder = tmp_path_factory.mktemp("package")
    with pytest.MonkeyPatch.context() as patch:
        own_package.install(folder, own_package.code(), own_package.points(), patch)
        forget(EFFECTS)
        yield kind_named(OWN)
    forget(EFFECTS)


@pytest.fixture(scope="module")
def rollers(own: type[Effect]) -> tuple[PlantedEffect, ...]:
    """Friction on three rollers beside viscous and Coulomb friction."""
    sizes = {"viscous_friction": 4.0, "coulomb_friction": 2.0}
    plain = (planted(kind, ELBOW, size) for kind, size in sizes.items())
    return (*plain, planted(OWN, ELBOW, 3.0, sin=-1.5))


@pytest.fixture(scope="module")
def data(rollers: tuple[PlantedEffect, ...]) -> Dataset:
    return played(rollers)


@pytest.fixture(scope="module")
def named(data: Dataset) -> Callable[..., Named]:
    """What a diagnosis names on the elbow, with values; elsewhere only what every robot has."""

    def run(*kinds: str) -> Named:
        found = told(data, ",".join(kinds) or "all")
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


def test_what_it_states_of_itself_keeps_it_out(
    own: type[Effect], named: Callable[..., Named], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A price, a limit, what its parameters may be, and whom it is not named beside."""
    first, second = own.parameters
    few = (*RIVALS, OWN)
    assert set(named(*few)) >= {OWN, "viscous_friction"}
    changes: list[tuple[str, Any]] = [
        ("prior_cost", 1e9),
        ("possible", lambda self, values: float(np.hypot(*values)) < 1.0),
        ("parameters", (replace(first, believed=(-1.0, 1.0)), second)),
        ("parameters", (first, replace(second, nonnegative=True))),
    ]
    for trait, value in changes:
        with monkeypatch.context() as patch:
            patch.setattr(own, trait, value)
            assert OWN not in named("viscous_friction", OWN), trait
    monkeypatch.setattr(own, "excludes", ("viscous_friction",))
    assert len(set(named(*few)) & {OWN, "viscous_friction"}) == 1


def test_its_mechanism_is_in_the_simulated_robot(
    own: type[Effect],
    rollers: tuple[PlantedEffect, ...],
    data: Dataset,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from excite_cli.simulation.build import assemble

    build = assemble(ROBOT, standard_parameters(ROBOT), "run", rollers)
    assert [each.effect.kind for each in build.looped] == [OWN]
    assert OWN not in [each.effect.kind for each in build.compensated]
    monkeypatch.setattr(own, "build_into", lambda self, robot, values, numbers: None)
    without, rest = played(rollers), played(rollers[:2])
    for one, other, there in zip(without.runs, rest.runs, data.runs, strict=True):
        assert np.array_equal(one.tau, other.tau)
        assert np.abs(there.tau - one.tau)[:, ELBOW].max() > 2.0
