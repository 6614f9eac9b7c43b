"""The motions of a campaign's rounds: what each is planned for, from what is known by then."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from excite_cli.api.identifying import identify
from excite_cli.api.loading import Case, load_case, measured_case, problem_of
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
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.excitation.extension import why_not_planned
from excite_cli.excitation.invariant import design_for, invariants
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.robot.model import Robot
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.summary.motions import motion_sentence
from excite_cli.workers.base import Workers

MODEL = "model.yaml"
_FEWEST = 3  # motions of the first round: two are fitted, so that names rest on more than one


def diagnosis_of(number: int) -> str:
    """Name of the file with the diagnosis of a round."""
    return f"round_{number}_diagnosis.h5"


def warnings_only(tell: Tell) -> Tell:
    """What a step says is told where it matters beyond that step."""

    def told(note: Note) -> None:
        if note.level is Level.WARNING:
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
        problem = self._problem(at_pace(pace, self.case.spec), 1, count)
        path = self.folder / "round_1.h5"
        self._say(f"round 1: {count} motions")
        result = self._planned(problem, path)
        motions = self._motions(1, "first", path, result, pace)
        return CampaignRound(1, motions, efficiency=_efficiency(problem, result))

    def following(self, state: Campaign, number: int) -> CampaignRound:
        """A motion for what is known, and one for what is not."""
        found = self.folder / diagnosis_of(number - 1)
        pace = pace_of(number, state.asked.from_speed)
        spec = at_pace(pace, self._with_fit(state))
        known, unseen = self._effects(found)
        alone = state.asked.plain or not unseen
        case = replace(self.case, spec=_of(spec, number, 2 if alone else 1))
        following = plan_after(case, found, tell=lambda note: None)
        self._say(f"round {number}: {following.messages[0]}")
        path = self.folder / f"round_{number}.h5"
        result = self._planned(following, path)
        efficiency = _efficiency(following.model, result)
        purpose: Purpose = "separate" if following.purpose == "separate" else "excite"
        motions = self._motions(number, purpose, path, result, pace)
        if not alone:
            path = self.folder / f"round_{number}_explore.h5"
            problem = self._problem(_showing(spec, (*known, *unseen)), number, 1)
            what = f"exploration motion for {len(unseen)} untested candidate effects"
            self._say(f"round {number}: {what}")
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
        return problem_of(replace(self.case, spec=_of(spec, number, motions)), lambda note: None)

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
        """The config, its torques bounded for the uncertainty of the inertias that is left."""
        spec = self.case.spec
        # A fit of a robot whose base is measured has other rows than a motion: what the config
        # says of the inertias stays, which is wider.
        if spec.uncertainty is None or measured_case(self.case).robot.base_joints:
            return spec
        path = (self.folder / f"round_{state.rounds[-1].number}_fit.h5").resolve()
        logs = [self.folder / each.data for each in state.motions]
        model = load_case(self.folder / MODEL)
        identify(model, logs, output=path, overwrite=True, tell=lambda note: None)
        known = spec.uncertainty.model_copy(update={"fit": str(path)})
        return spec.model_copy(update={"uncertainty": known})

    def _say(self, text: str) -> None:
        self.tell(Note(Level.INFO, text))


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
    """The config for motions that are played at `pace`, so that none needs its own to hold."""
    if pace >= 1.0:
        return spec
    constraints = spec.constraints.model_copy(update={"any_speed": True})
    return spec.model_copy(update={"constraints": constraints})


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
