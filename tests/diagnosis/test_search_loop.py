"""Which pass of a diagnosis is the answer, with passes that find what they are told to find."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis import search_loop
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.identification.declared_states import LeftOut
from tests.diagnosis.explicit_data import anything, effect, on_joint_0, planted


class Fit(SimpleNamespace):
    """After a pass: what was found; fits of the same effects are alike."""

    def close_to(self, other: Any) -> bool:
        return bool(self.places == other.places)


class Named(str):
    """An effect by its name; some cut the torque."""

    def cuts_at(self) -> tuple[tuple[int, float], ...]:
        """`cut5` cuts joint 0 at 5."""
        return ((0, float(self[3:])),) if self.startswith("cut") else ()


def answer_of(
    monkeypatch: pytest.MonkeyPatch, found: list[str], errors: list[float], known: str = ""
) -> tuple[str, list[str]]:
    """What the traced answer of four passes found, and what these began from, in order.

    `known`: what was found in more of the same data, to begin from. A pass that begins from `rest`,
    what is beside a cut, finds `clean`.
    """
    began: list[str] = []
    attempts: dict[str, int] = {}  # who begins from the same finds the same
    taken: list[Any] = []

    def one_pass(*arguments: Any) -> Any:
        fit = arguments[-2]
        if fit.name not in attempts or fit.name == "clean":
            attempts[fit.name] = sum(name != "rest" for name in began)
        attempt = attempts[fit.name]
        began.append(fit.name)
        name = "clean" if fit.name == "rest" else found[attempt]
        return SimpleNamespace(
            name=name, chosen=(), candidates=(), attempt=attempt, taken=taken[-1:]
        )

    def fit_of(_: Any, traced: Any) -> Fit:
        return Fit(name=traced.name, places={traced.name}, effects=(Named(traced.name),))

    def by(effects: Any, cutting: Any = ()) -> tuple[str, ...]:
        return (*effects, *(f"without {each}" for each in cutting))

    def prepared(left_out: Any) -> list[str]:
        taken.append(left_out)
        return ["run"]

    monkeypatch.setattr(LeftOut, "by", by)
    monkeypatch.setattr(
        search_loop, "ModelledRun", lambda *_: SimpleNamespace(take=lambda run, columns: None)
    )
    start = Fit(name="declared", places=set(), effects=())
    monkeypatch.setattr(
        search_loop,
        "_first_fit",
        lambda *given: fit_of(None, SimpleNamespace(name=known)) if given[-1] else start,
    )
    monkeypatch.setattr(search_loop, "inertial_columns", lambda model, runs: [None for _ in runs])
    monkeypatch.setattr(search_loop, "fit_of", fit_of)
    monkeypatch.setattr(search_loop, "_one_pass", one_pass)
    monkeypatch.setattr(search_loop, "_PASSES", 4)
    monkeypatch.setattr(search_loop, "_left_out", lambda traced: errors[traced.attempt])
    rest = Fit(name="rest", places={"rest"}, effects=())
    monkeypatch.setattr(search_loop, "beside_cuts", lambda fit: rest)
    monkeypatch.setattr(search_loop, "_without_kinds", lambda spec, effects: spec)
    model: Any = SimpleNamespace(declared=(), vague=False)
    nothing = DiagnosisSpec(rounds=0)
    begin: Any = (known,) if known else ()
    traced: Any
    traced, _ = search_loop.trace(model, nothing, prepared, (), (), lambda *_: None, begin)
    before = began[-1]
    # The answer's own samples: those that the pass before it left.
    assert traced.taken == [(before,) if before != "declared" else ()]
    return traced.name, began


def test_a_pass_that_finds_the_same_again_ends_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    name, began = answer_of(monkeypatch, ["a", "b", "b"], [0.0, 1.0, 2.0])
    assert (name, began) == ("b", ["declared", "a", "b"])


def test_of_passes_that_go_round_the_best_is_made_once_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    name, began = answer_of(monkeypatch, ["a", "b", "c", "d"], [5.0, 4.0, 4.5, 5.0])
    assert name == "b"
    assert began == ["declared", "a", "b", "c", "a"]


@pytest.mark.parametrize(("error", "name"), [(4.99, "d"), (4.97, "b")])
def test_the_last_pass_stays_where_none_is_clearly_better(
    monkeypatch: pytest.MonkeyPatch, error: float, name: str
) -> None:
    errors = [5.1, error, 5.1, 5.0]
    assert answer_of(monkeypatch, ["a", "b", "c", "d"], errors)[0] == name


def test_what_was_found_in_more_of_the_data_is_found_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It does not end the search, for it is of other data."""
    assert answer_of(monkeypatch, ["a", "a", "", ""], [9.0] * 4, known="a") == ("a", ["a", "a"])
    answer = answer_of(monkeypatch, ["b", "c", "d", "e"], [4.0, 5.0, 5.0, 5.0], known="a")
    assert answer == ("b", ["a", "b", "c", "d", "a"])


def test_a_cut_leaves_what_is_beside_it() -> None:
    kinds = catalogue()
    effects = (
        kinds["spring"]((0,)),
        kinds["torque_saturation"]((1,), {"level": 3.0}),
        kinds["viscous_friction"]((1,)),
    )
    sizes = [len(each.parameters) for each in effects]
    values = np.concatenate([[0.5, 0.6], *(np.full(w, k) for k, w in enumerate(sizes))])
    rest = search_loop.beside_cuts(
        search_loop.PassFit(np.zeros(10), effects, values, np.ones(4), 1.0)
    )
    assert rest.effects == (effects[0], effects[2])
    assert rest.values.tolist() == [0.5, 0.6, *sizes[0] * [0], *sizes[2] * [2]]
    # A search without cuts knows no kind of them.
    cut = catalogue()["torque_saturation"]((1,), {"level": 3.0})
    blind = search_loop._without_kinds(DiagnosisSpec(exclude=["backlash"]), [cut])
    assert (blind.exclude, blind.rounds) == (["backlash", "torque_saturation"], 60)
    alone = DiagnosisSpec(kinds=["torque_saturation"])
    assert search_loop._without_kinds(alone, [cut]).rounds == 0


def test_what_is_beside_a_cut_is_looked_for_without_its_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And once more where the cut turns out to lie elsewhere; then the cut is found anew."""
    name, began = answer_of(monkeypatch, ["cut4", "cut5", "cut5.1", "cut5.1"], [1.0] * 4)
    assert name == "cut5.1"
    assert began == ["declared", "rest", "clean", "rest", "clean", "cut5.1"]


def test_a_pass_that_is_cut_short_keeps_what_the_pass_before_it_found() -> None:
    """At once over, the search alone knows the textbook's offset, and no spring."""
    effects = [effect("spring"), effect("torque_offset")]
    data, candidates = planted(effects, np.array([[5.0, 0.0]] * 3))
    plain = data.evidence(candidates, NoiseModel.white(np.ones(2)))
    model: Any = SimpleNamespace(is_weighed=False, states={})
    for found, named in ((), [1]), ((0, 1), [0, 1]):
        judge = Judgement(plain, plain, candidates, Rules(0.01, 0.01), anything, found)
        assert sorted(search_loop._searched(judge, 60, data, model, lambda: True)) == named


def fit_of(*effects: Effect) -> search_loop.PassFit:
    return search_loop.PassFit(np.zeros(10), effects, np.zeros(len(effects)), np.ones(2), 100.0)


def test_a_fit_is_settled_once_its_shapes_are() -> None:
    """Energies are in units of the noise that is left: they say nothing of a shape that moved."""
    one = fit_of(effect("ripple", periods=20.0), effect("spring"))
    for periods, settled in ((20.4, True), (21.2, False), (30.0, False)):
        assert one.close_to(fit_of(effect("ripple", periods=periods), effect("spring"))) == settled
    assert not one.close_to(replace(one, energy=101.0))
    assert not one.close_to(replace(one, levels=np.array([1.0, 1.1])))


def test_noise_is_measured_in_the_shape_that_leaves_least() -> None:
    """The second of three shapes of the excess is the true one; the first was found before."""
    effects = [
        effect("viscous_friction"),
        effect("stribeck_friction", stribeck_speed=0.1),
        effect("stribeck_friction", stribeck_speed=0.13),
        effect("stribeck_friction", stribeck_speed=0.2),
    ]
    mix = np.eye(4)
    mix[2, [1, 3]] = 2.0  # both have some of the true one
    data, candidates = planted(effects, on_joint_0([1.0, 0.0, 3.0, 0.0]), mix)
    plain = data.evidence(candidates, NoiseModel.white(np.ones(2)))
    assert search_loop._of_best_shapes(plain, candidates, [0, 1]) == [0, 2]
    assert search_loop._of_best_shapes(plain, candidates, [0]) == [0]
