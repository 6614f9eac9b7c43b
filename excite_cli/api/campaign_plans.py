"""The motions of a campaign's rounds: what each is planned for, from what is known by then."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from excite_cli.api.identifying import identify
from excite_cli.api.loading import Case, load_case, measured_case, problem_of
from excite_cli.api.model import Model, load_model
from excite_cli.api.motions import load_motions
from excite_cli.api.planning import Planned, PlanProgress, plan, plan_after
from excite_cli.campaign.records import (
    Campaign,
    CampaignRound,
    PlayedMotion,
    Purpose,
    looked_for,
    pace_of,
)
from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import FourierSpec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.effect_columns import why_not_planned
from excite_cli.excitation.invariant import design_for, invariants
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.note import Level, Note, Tell, unheard
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.result_file import read_result
from excite_cli.summary.motions import motion_sentence
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Workers

MODEL = "model.yaml"
_FIRST = "round_1.h5"
_FEWEST_FROM_REST = 3  # harmonics
_FEWEST = 3  # motions of the first round: two are fitted, so that names rest on more than one


def diagnosis_of(number: int) -> str:
    """Name of the file with the diagnosis of a round."""
    return f"round_{number}_diagnosis.h5"


def warnings_only(tell: Tell) -> Tell:
    """What a step says is told where it matters beyond that step, and what it does."""

    def told(note: Note) -> None:
        if note.level in (Level.WARNING, Level.STEP):
            tell(note)

    return told


@dataclass(frozen=True)
class RoundPlans:
    """Plans of a campaign in `folder`, each written there before it is played."""

    case: Case
    folder: Path
    workers: Workers | None
    progress: PlanProgress
    tell: Tell

    def first(self, state: Campaign) -> CampaignRound:
        """Motions for the model as it is declared."""
        count = max(self.case.spec.sequence.motions or _FEWEST, _FEWEST)
        pace = pace_of(1, state.asked.from_speed)
        spec, path = at_pace(pace, self.case.spec), self.folder / _FIRST
        self._begin(1, f"planning {count} motions")
        problem = self._problem(from_rest(spec) if state.asked.entry else spec, 1, count)
        try:
            result = self._planned(problem, path)
        except NoAdmissibleMotionError:  # the posture leaves no room to begin and end there
            problem = self._problem(spec, 1, count)
            result = self._planned(problem, path)
        motions = self._motions(1, "first", path, result, pace)
        return CampaignRound(1, motions, efficiency=_efficiency(problem, result))

    def following(self, state: Campaign, number: int) -> CampaignRound:
        """A motion for what is known, and one for what is not.

        At full pace as soon as nothing is open and the torques of the model allow it, else twice
        as fast as the round before.
        """
        last, pace = state.rounds[-1], pace_of(number, state.asked.from_speed)
        if last.pace >= 1.0 or pace >= 1.0:
            return self._round(state, number, 1.0, f"round_{number}")
        if last.learned is not None and not last.learned.open:
            found = self._round(state, number, 1.0, f"round_{number}")
            if self._allowed(found, number):
                self._say(f"round {number}: full pace, within the limits of torque by 3 σ")
                return found
        return self._round(state, number, pace, f"round_{number}_slower")

    def _allowed(self, planned: CampaignRound, number: int) -> bool:
        """Whether the model of the round before keeps the limits of torque in these motions."""
        path = self.folder / diagnosis_of(number - 1)
        known = plan_after(self.case, path, tell=unheard).known
        motions = [
            motion
            for each in planned.motions
            for motion in load_motions(self.case, self.folder / each.plan, (each.index,))
        ]
        return known is not None and within_torque(load_model(path), known, motions)

    def _round(self, state: Campaign, number: int, pace: float, name: str) -> CampaignRound:
        """The motions of a round at this pace; its plans are called `name`."""
        found = self.folder / diagnosis_of(number - 1)
        spec = at_pace(pace, self._with_fit(state))
        known, unseen = self._effects(found)
        alone = state.asked.plain or not unseen
        case = replace(self.case, spec=_of(spec, number, 2 if alone else 1))
        following = plan_after(case, found, tell=unheard)
        self._begin(number, f"planning a motion. {following.messages[0]}")
        path = self.folder / f"{name}.h5"
        result = self._planned(following, path)
        efficiency = _efficiency(following.model, result)
        purpose: Purpose = "separate" if following.purpose == "separate" else "excite"
        motions = self._motions(number, purpose, path, result, pace)
        if not alone:
            path = self.folder / f"{name}_explore.h5"
            problem = self._problem(_showing(spec, (*known, *unseen)), number, 1)
            what = f"exploration motion for {len(unseen)} untested candidate effects"
            self._begin(number, f"planning an {what}")
            logs = [self.folder / each.data for each in state.motions]
            result = self._planned(problem, path, logs)
            motions += self._motions(number, "explore", path, result, pace, len(motions))
        return CampaignRound(number, motions, efficiency=efficiency)

    def _effects(self, found: Path) -> tuple[tuple[EffectSpec, ...], tuple[EffectSpec, ...]]:
        """What is declared or found, and what is neither, of effects that motions can show."""
        robot, read = self.case.robot, read_diagnosis(found)
        records = [*read.declared, *(each.effect for each in read.effects)]
        known = [effect_of(each, robot.joint_names) for each in on_robot(records, robot)]
        both = known, looked_for(robot, known)
        here, unseen = (
            tuple(
                EffectSpec(
                    kind=each.kind,
                    joints=tuple(robot.joint_names[j] for j in each.joints),
                    shape=dict(each.shape),
                )
                for each in effects
                if not why_not_planned(each, robot)
            )
            for effects in both
        )
        return here, unseen

    def _problem(self, spec: Spec, number: int, motions: int) -> Problem:
        return problem_of(replace(self.case, spec=_of(spec, number, motions)), unheard)

    def _planned(self, problem: Planned, path: Path, logs: Sequence[Path] = ()) -> Result:
        found = plan(
            problem,
            priors=logs,
            output=path,
            resume=path.exists(),
            progress=self.progress,
            workers=self.workers,
            tell=warnings_only(self.tell),
        )
        for motion in found.motions:
            self._say(motion_sentence(motion))
        return found

    def _motions(
        self,
        number: int,
        purpose: Purpose,
        path: Path,
        result: Result,
        pace: float,
        before: int = 0,
    ) -> tuple[PlayedMotion, ...]:
        return tuple(
            PlayedMotion(
                f"round_{number}_motion_{before + k}", purpose, path.name, each.index, pace
            )
            for k, each in enumerate(result.motions, start=1)
        )

    def _with_fit(self, state: Campaign) -> Spec:
        """The config with the trajectory of the first round.

        Its torques are bounded for the uncertainty of the inertias that is left.
        """
        first = parse_spec(read_result(self.folder / _FIRST).config, f"the config in {_FIRST}")
        spec = self.case.spec.model_copy(update={"trajectory": first.trajectory})
        # A fit of a robot whose base is measured has other rows than a motion: what the config
        # says of the inertias stays, which is wider.
        if spec.uncertainty is None or measured_case(self.case).robot.base_joints:
            return spec
        path = (self.folder / f"round_{state.rounds[-1].number}_fit.h5").resolve()
        logs = [self.folder / each.data for each in state.motions]
        model = load_case(self.folder / MODEL)
        identify(model, logs, output=path, overwrite=True, tell=unheard)
        known = spec.uncertainty.model_copy(update={"fit": str(path)})
        return spec.model_copy(update={"uncertainty": known})

    def _say(self, text: str) -> None:
        self.tell(Note(Level.INFO, text))

    def _begin(self, number: int, what: str) -> None:
        self._say(f"round {number}: {what}")
        self.tell(Note(Level.STEP, "", f"round {number}, planning"))


def on_robot(records: Sequence[EffectRecord], robot: Robot) -> list[EffectRecord]:
    """What a planned motion can know of effects: their joints among those of `robot`.

    Data of a robot that stands have six joints more, of its base; what is there alone is left out.
    """
    names = set(robot.joint_names)
    own = [replace(r, joints=tuple(j for j in r.joints if j in names)) for r in records]
    return [each for each in own if each.joints]


def _of(spec: Spec, number: int, motions: int) -> Spec:
    """The config for so many motions of a round, which has starts of its own."""
    sequence = spec.sequence.model_copy(update={"motions": motions, "until": None})
    return spec.model_copy(update={"sequence": sequence, "seed": spec.seed + number - 1})


def at_pace(pace: float, spec: Spec) -> Spec:
    """The config for motions that keep this share of the limits of speed, acceleration and jerk.

    Planned for it they are no longer than at full pace, as motions that are slowed down are. Where
    no limits of joints are kept, they are slowed, and planned so that none needs its speed to hold.
    """
    if pace >= 1.0:
        return spec
    limits = spec.constraints.joint_limits
    if limits is None:
        change: dict[str, object] = {"any_speed": True}
    else:
        change = {"joint_limits": limits.model_copy(update={"pace": pace * limits.pace})}
    return spec.model_copy(update={"constraints": spec.constraints.model_copy(update=change)})


def from_rest(spec: Spec) -> Spec:
    """The config for motions that begin and end at rest at its posture, and need no way there.

    The ways into motions and back are half of the seconds of a campaign without it, and a motion
    from rest is as good. One that begins at a posture of the config's own stays.
    """
    trajectory = spec.trajectory
    least = _FEWEST_FROM_REST
    if isinstance(trajectory, FourierSpec):
        few = trajectory.harmonics is not None and trajectory.harmonics < least
        ends: dict[str, object] = {"start": "posture"}
    else:
        points = trajectory.control_points
        few = points is not None and points < trajectory.degree + least + 4
        ends = {"start": "posture", "end": "posture"}
    if few or trajectory.start is not None:
        return spec
    new = trajectory.model_copy(update={"at_rest": True, **ends})
    return spec.model_copy(update={"trajectory": new})


def _showing(spec: Spec, effects: tuple[EffectSpec, ...]) -> Spec:
    """The config with these effects declared, to be known as well as can be beside each other.

    By the determinant: of so many columns some can hardly be told from others, and a condition
    number would see nothing but these.
    """
    wanted = {"kind": "log_det", "column_scaling": "unit_norm"}
    criterion = spec.criterion.model_copy(update=wanted)
    return spec.model_copy(update={"effects": effects, "criterion": criterion})


def _efficiency(problem: Problem, result: Result) -> float | None:
    """Of the motions by themselves: how much an instant tells, of what free states could."""
    stack, objective = Stack.empty(problem.columns), problem.objective()
    for motion in result.motions:
        stack = objective.added_to(stack, motion.coefficients)
    return invariants(problem, stack, design_for(problem)).efficiency


# Whether a round may be played at full pace: by the torques that the fitted model expects.

_SIGMAS = 3.0
_STEP = 0.02  # [s]


def torque_deviation(known: tuple[Problem, Stack], times: Array, states: Sequence[Array]) -> Array:
    """Standard deviation (T, n) of the model's torque [N·m; N] at states q, v, a (T, n).

    √diag(Y M⁻¹ Yᵀ), with Y the columns of base parameters and effects and M = RᵀR + CᵀC what the
    prior and the data say of them (`excitation/prediction.py`). `known`: the problem in which they
    are unknown, and the data C on its columns. Of effects that the model has not, the prior is
    narrower where a share of the usual torque, RMS, would be far more at its largest: Stribeck
    friction that ends at 0.02 rad/s is no 40 N·m.
    """
    problem, stack = known
    prediction = problem.prediction
    assert prediction is not None
    rows = problem.objective().block_of(times, *states)
    torques = rows.reshape(len(times), -1, rows.shape[1]) / problem.weighting.rows[:, None]
    largest = np.max(np.abs(torques).max(axis=0) / prediction.usual[:, None], axis=0)
    slices = prediction.extension.columns().slices
    first = slices[prediction.declared].start if prediction.declared < len(slices) else None
    added = np.square(np.maximum(largest[prediction.rank :] / prediction.shares, 1.0)) - 1.0
    added[:first] = 0.0
    information = prediction.information(stack.factor)
    information[np.diag_indices(len(information))] += np.append(np.zeros(prediction.rank), added)
    spread = np.linalg.solve(information, rows.T)
    variance = np.sum(rows * spread.T, axis=1).reshape(len(times), -1)
    return np.asarray(np.sqrt(variance) / problem.weighting.rows)


def within_torque(
    model: Model, known: tuple[Problem, Stack], motions: Sequence[Segment], sigmas: float = _SIGMAS
) -> bool:
    """Whether torques keep the effort limits along `motions`, so many standard deviations aside.

    Of motors that have less torque at speed: that of the speed, which braking need not keep.
    """
    curves = known[0].robot.limits.curves
    for motion in motions:
        times = np.arange(0.0, motion.trajectory.duration, _STEP)
        states = motion.trajectory.states(times, motion.coefficients)
        most = np.abs(model.torque(*states, t=times))
        most += sigmas * torque_deviation(known, times, states)
        speed = np.abs(states[1])
        if any(np.any(most[:, j] > curve.effort(speed[:, j])) for j, curve in enumerate(curves)):
            return False
    return True
