"""Runs, columns and states of runs that the configuration names, and whether the data have them.

    runs: {monday_3: {payload: tool_2kg}, tuesday_1: {payload: tool_2kg}, friday_2: {payload: none}}

Runs with one label share one state: an effect of that kind is in all of them or in none. Where
labels of a kind are declared, runs without one are without the effect.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Array, Mask
from excite_cli.config.spec import Spec
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.errors import ConfigError, nearest
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Dataset

# Samples that no fit may use, since the columns of some effect are wrong there.

_MOST = 1.0 / 3.0  # of the whole way of a run that is given up
_BELOW = 0.95  # of a level that cuts the torque: readings nearer to it, with their noise, are cut


@dataclass(frozen=True)
class LeftOut:
    """What a joint's columns depend on beside its own speed.

    `coupled` (j, k, s): the gears of joints j and k rub on v_j + s v_k, which may stick as well.
    `ways` (j, x): joint j must have gone x [rad] since the run began.
    `cuts` (j, L): torque of joint j is cut off at L [N·m], and says nothing of the robot there.
    """

    coupled: tuple[tuple[int, int, float], ...] = ()
    ways: tuple[tuple[int, float], ...] = ()
    cuts: tuple[tuple[int, float], ...] = ()

    @classmethod
    def by(cls, effects: Sequence[Effect], cutting: Sequence[Effect] = ()) -> "LeftOut":
        """What the columns of `effects` ask for, without what those that are `cutting` cut off."""
        return cls(
            tuple(sorted(shaft for effect in effects for shaft in effect.coupled_speeds())),
            tuple(sorted(way for effect in effects for way in effect.forgets_over())),
            tuple(sorted(cut for effect in cutting for cut in effect.cuts_at())),
        )

    def below_cuts(self, tau: Array) -> Mask:
        """Samples (T, n) of torques that no cut touches."""
        below = np.ones(tau.shape, dtype=bool)
        for j, level in self.cuts:
            below[:, j] &= np.abs(tau[:, j]) < _BELOW * level
        return below

    def on_the_way(self, q: Array, past: Array) -> Mask:
        """Samples (T, n) of positions in which every joint has gone its way, the `past` (L, n) too.

        Of a run that hardly goes further, a third of its way is enough.
        """
        there = np.ones(q.shape, dtype=bool)
        for j, way in self.ways:
            whole = np.concatenate([past[:, j], q[:, j]])
            gone = np.cumsum(np.abs(np.diff(whole, prepend=whole[:1])))[len(past) :]
            there[:, j] &= gone >= min(way, gone[0] + _MOST * (gone[-1] - gone[0]))
        return there


NONE = "none"

States = Mapping[str, Mapping[str, str]]  # run -> kind -> label


def declared_sets(kind: str, states: States) -> list[tuple[str, ...]] | None:
    """The sets of runs that share a state of `kind`; None if nothing is declared of it."""
    labels = {run: of_run[kind] for run, of_run in states.items() if kind in of_run}
    if not labels:
        return None
    there = dict.fromkeys(label for label in labels.values() if label != NONE)
    return [tuple(run for run, its in labels.items() if its == label) for label in there]


def check_declared_runs(spec: Spec, dataset: Dataset) -> None:
    """Refuse effects and states that are declared for a run which `dataset` does not hold.

    And effects that follow a column which is not declared.

    Raises
    ------
    ConfigError
        There is no run or column of such a name, or a state is of a kind that all runs share.
    """
    names, columns = dataset.names, spec.measurement.covariates
    for index, effect in enumerate(spec.effects or ()):
        if effect.covariate and effect.covariate not in columns:
            raise ConfigError(
                f"effects[{index}].covariate: '{effect.covariate}' is not declared."
                f"{nearest(effect.covariate, columns)} measurement.covariates: "
                f"{', '.join(columns) or 'none'}."
            )
        if effect.runs != "all":
            _require_runs(f"effects[{index}].runs", effect.runs, names)
    check_states(spec.runs, names)
    known = spec.identification.known_payload
    _require_runs("identification.known_payload.runs", known.runs if known else (), names)


def _require_runs(where: str, declared: Iterable[str], names: Sequence[str]) -> None:
    for name in declared:
        if name not in names:
            raise ConfigError(
                f"{where}: there is no run '{name}' in the data.{nearest(name, names)} "
                f"Runs: {', '.join(names)}."
            )


def check_states(states: States, names: Sequence[str]) -> None:
    """Refuse states of runs that are not among the `names` of the data, or of other kinds.

    Raises
    ------
    ConfigError
        There is no such run or kind, or the kind does not differ between runs.
    """
    for run, labels in states.items():
        _require_runs("runs", (run,), names)
        for kind in labels:
            if not _differs_between_runs(kind_named(kind, f"runs.{run}")):
                able = [name for name, k in catalogue().items() if _differs_between_runs(k)]
                raise ConfigError(
                    f"runs.{run}: {kind} is not of single runs. Kinds that are: {', '.join(able)}."
                )


def _differs_between_runs(kind: type[Effect]) -> bool:
    return kind.per_run or kind.changes_between_runs


def check_left_to_fit(spec: Spec, parts: Split) -> None:
    """Refuse effects, or a known payload, of held-out runs only: nothing would be fitted of them.

    Raises
    ------
    ConfigError
        There is such an effect.
    """
    declared = [
        (f"effects[{index}]", each.kind, () if each.runs == "all" else each.runs)
        for index, each in enumerate(spec.effects or ())
    ]
    needed = spec.identification.needed_runs
    for where, what, names in [*declared, ("identification.known_payload", "the payload", needed)]:
        if names and not any(run.id.is_among(names) for run in parts.training):
            others = [unit for unit in parts.units if unit not in (*names, parts.held_out_name)]
            instead = f" Hold out another run: --held-out '{others[-1]}'." if others else ""
            raise ConfigError(
                f"{where}.runs: '{', '.join(names)}' is held out, so that nothing is left "
                f"to fit {what} on.{instead}"
            )
