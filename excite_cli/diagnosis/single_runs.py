"""Effects of single runs: what is assumed of the held-out run, and what they are worth elsewhere.

Of two recordings neither says what is usual: by how much more friction, offset or gain there is in
one of them is told, and the model has what suits both (`differences_between_runs`).

Any other such effect is not in the held-out run unless the configuration says so. So the ends of
the training runs that carry one are held out, too (`split.with_ends_held_out`), and the errors
there are measured.
"""

from collections.abc import Sequence

from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.held_out_errors import HeldOutRuns
from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.diagnosis.records import Assumption, HeldOutEnds
from excite_cli.diagnosis.search_loop import differences
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.effects.base import Effect
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import Processing
from excite_cli.identification.regression import places_of
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Finding, Run
from excite_cli.robot.model import Robot

_MOST_TOLD = 4
# Of the error on data left out, by which a difference must lower it to be worth another recording:
# of three robots that were the same in both, differences of 1, 2 and 2 % were told, where friction
# had warmed up 15 to 67 %.
_WORTH_TELLING = 0.1


def runs_of_their_own(effects: Sequence[Effect]) -> set[str]:
    """Runs that have an effect for all of their time: one with a shape may have its own window."""
    return {run for effect in effects if not effect.shapes for run in effect.runs}


def differences_between_runs(traced: SearchResult) -> tuple[Finding, ...]:
    """One line on all by which two recordings differ beyond chance; no line if by nothing."""
    judge, model = traced.judge, traced.model
    open_ = list(differences(traced.candidates, traced.data, model))
    chosen, found = list(traced.chosen), list[int]()
    while len(found) < _MOST_TOLD:
        singles = judge.white.schur(chosen).singles
        saved = {i: singles[i].chi2 - judge.price(i, singles[i].dof) for i in open_}
        best = max(saved, key=saved.__getitem__, default=None)
        if best is None or saved[best] <= 0.0:
            break
        open_.remove(best)
        worth = judge.left_out_gain(chosen, [best]) > _WORTH_TELLING
        if worth and judge.verdict(chosen, [best]) is Verdict.ACCEPTED:
            chosen.append(best)
            found.append(best)
            there = traced.candidates[best].place[:2]  # in whichever run
            open_ = [i for i in open_ if traced.candidates[i].place[:2] != there]
    if not found:
        return ()
    effects = [traced.candidates[i].effect for i in found]
    sizes = judge.plain.solve(chosen)
    joints, parts = model.robot.joint_names, []
    for each, own in zip(effects, places_of(effects, len(sizes)), strict=True):
        on = " and ".join(joints[j] for j in each.joints)
        unit = each.unit_on(each.parameters[0].unit, model.robot.sliding)
        size = f"{sizes[own][0]:+.3g}{'' if unit == '1' else f' {unit}'}"
        parts.append(f"{each.kind} of {on} by {size} in {', '.join(each.runs)}")
    one, other = sorted({run.run.name for run in traced.data.runs})
    states = ", ".join(dict.fromkeys(f"{each.kind}: %s" for each in effects))
    declared = ", ".join(
        f"{run}: {{{states.replace('%s', label)}}}" for run, label in ((one, "a"), (other, "b"))
    )
    text = (
        f"recordings {one} and {other} differ: {'; '.join(parts)}. With two recordings the normal "
        "value is unknown: the model has one for both. Record a third one, or declare the states: "
        f"runs: {{{declared}}}"
    )
    return (Finding("runs_differ", "warning", text),)


def assumptions(
    effects: Sequence[Effect], parts: Split, model: DeclaredModel
) -> tuple[Assumption, ...]:
    """What was assumed of the held-out run, where the states of runs do not say it.

    Of held-out blocks of the very recording that carries an effect there is nothing to assume.
    """
    names = model.robot.joint_names
    held_out = tuple(dict.fromkeys(run.id.key for run in parts.held_out))
    found = []
    for effect in effects:
        stated = [run for run, states in model.states.items() if effect.kind in states]
        declared = all(run.id.is_among(stated) for run in parts.held_out)
        active = all(effect.active(run.id) for run in parts.held_out)
        if effect.runs and not declared and not active:
            joints = tuple(names[j] for j in effect.joints)
            found.append(Assumption(effect.kind, effect.runs, held_out, False, joints))
    return tuple(found)


def on_held_out_ends(
    robot: Robot,
    models: tuple[IdentifiedModel, IdentifiedModel],
    ends: Sequence[Run],
    processing: Processing,
) -> tuple[HeldOutEnds, ...]:
    """Errors on the held-out ends, together for runs that carry the same effects."""
    single = [effect for effect in models[1].effects if effect.runs]
    alike: dict[tuple[bool, ...], list[Run]] = {}
    for run in ends:
        alike.setdefault(tuple(effect.active(run.id) for effect in single), []).append(run)
    found = []
    for active, runs in alike.items():
        own = [effect for effect, here in zip(single, active, strict=True) if here]
        played = HeldOutRuns(robot, prepare_all(runs, processing))
        before, after = (played.errors(played.predictions(model)) for model in models)
        found.append(
            HeldOutEnds(
                tuple(dict.fromkeys(run.id.key for run in runs)),
                tuple(record_of(effect, robot.joint_names) for effect in own),
                before,
                after,
            )
        )
    return tuple(found)
