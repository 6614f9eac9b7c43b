"""Effects of single runs: what is assumed of the sealed run, and what they are worth elsewhere.

Such an effect is not in the sealed run unless the configuration says so. So the ends of the
training runs that carry one are sealed, too (`split.with_ends_sealed`), and the errors there are
measured.
"""

from collections.abc import Sequence

from excite_cli.diagnosis.before_after import Played, on_sealed
from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.records import Assumption, SealedEnds
from excite_cli.effects.base import Effect
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import Processing
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Run


def runs_of_their_own(effects: Sequence[Effect]) -> set[str]:
    """Runs that have an effect for all of their time: one with a shape may have its own window."""
    return {run for effect in effects if not effect.shapes for run in effect.runs}


def assumptions(effects: Sequence[Effect], parts: Split, model: Model) -> tuple[Assumption, ...]:
    """What was assumed of the sealed run, where the states of runs do not say it.

    Of sealed blocks of the very recording that carries an effect there is nothing to assume.
    """
    names = model.robot.joint_names
    sealed = tuple(dict.fromkeys(run.id.key for run in parts.sealed))
    return tuple(
        Assumption(effect.kind, effect.runs, sealed, False, tuple(names[j] for j in effect.joints))
        for effect in effects
        if effect.runs
        and not _declared(effect, parts.sealed, model)
        and not all(effect.active(run.id) for run in parts.sealed)
    )


def _declared(effect: Effect, sealed: Sequence[Run], model: Model) -> bool:
    """Whether the sealed runs have declared states of the effect's kind."""
    known = [run for run, states in model.states.items() if effect.kind in states]
    return all(run.id.is_among(known) for run in sealed)


def on_sealed_ends(
    model: Model,
    models: tuple[IdentifiedModel, IdentifiedModel],
    ends: Sequence[Run],
    processing: Processing,
) -> tuple[SealedEnds, ...]:
    """Errors on the sealed ends, together for runs that carry the same effects."""
    single = [effect for effect in models[1].effects if effect.runs]
    alike: dict[tuple[bool, ...], list[Run]] = {}
    for run in ends:
        alike.setdefault(tuple(effect.active(run.id) for effect in single), []).append(run)
    found = []
    for active, runs in alike.items():
        own = [effect for effect, here in zip(single, active, strict=True) if here]
        played = Played(model.robot, prepare_all(runs, processing))
        errors = on_sealed(played, *map(played.predictions, models))
        found.append(
            SealedEnds(
                tuple(dict.fromkeys(run.id.key for run in runs)),
                tuple(record_of(effect, model.robot.joint_names) for effect in own),
                errors.before,
                errors.after,
            )
        )
    return tuple(found)
