"""How an effect is drawn is what its kind states; the names of quantities decide nothing."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.effects.catalogue import catalogue
from excite_cli.report.plot import Plot
from excite_cli.shown.answer import Charts, Detail
from excite_cli.summary.effect_evidence import evidence_section
from tests.diagnosis.synthetic_diagnosis import make_diagnosis, make_traces


@pytest.fixture(scope="module")
def plain() -> Diagnosis:
    """Viscous friction of the elbow, with its trace."""
    found = make_diagnosis()
    traces, _ = make_traces(found.joint_names)
    return replace(found, traces=traces)


def charts(plain: Diagnosis, kinds: Sequence[str], quantity: str = "speed") -> list[Plot]:
    """The same samples, as effects of these kinds over this quantity."""
    assert plain.traces is not None
    (named,), (trace,) = plain.effects, plain.traces.effects
    effects = tuple(replace(named, effect=replace(named.effect, kind=kind)) for kind in kinds)
    drawn = tuple(replace(trace, kind=kind, quantity=quantity) for kind in kinds)
    found = replace(plain, effects=effects, traces=replace(plain.traces, effects=drawn))
    section = evidence_section(found, Detail.PAGE)
    cards = [c for block in section.blocks if isinstance(block, Charts) for c in block.charts]
    return [card for card in cards if isinstance(card, Plot)]


@pytest.mark.parametrize("kind", ["contact", "torque_offset", "payload", "of_another_installation"])
def test_a_touch_is_shown_while_it_lasts_all_else_as_samples(plain: Diagnosis, kind: str) -> None:
    (chart,) = charts(plain, [kind])
    assert ("s the partial residual torque ranges" in chart.alternative) == (kind == "contact")


def test_any_kind_may_ask_for_the_seconds_in_which_it_shows(
    plain: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalogue()["spring"], "picture", "window")
    (chart,) = charts(plain, ["spring"])
    assert "s the partial residual torque ranges" in chart.alternative


@pytest.mark.parametrize("quantity", ["speed", "velocity"])
def test_functions_of_the_speed_are_also_drawn_together(plain: Diagnosis, quantity: str) -> None:
    def together(*kinds: str) -> list[str]:
        return [c.title for c in charts(plain, kinds, quantity) if c.title == "Friction of elbow"]

    assert together("viscous_friction", "coulomb_friction") == ["Friction of elbow"]
    assert together("viscous_friction", "spring") == []
    assert together("viscous_friction", "friction_drift") == []
    assert together("viscous_friction", "of_another_installation") == []
