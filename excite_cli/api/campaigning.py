"""Plan, have it measured, diagnose, plan the next: `excite campaign`.

Every round plays a motion for what is known (it separates effects that could be each other, else
excites the model with all effects found) and one that makes visible what nobody has found yet. The
newest motion takes no part in the diagnosis: what the model misses there is the campaign's error;
from the next round on it is one of those that the model is fitted to.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.checking import check
from excite_cli.api.diagnosing import diagnose, save_config
from excite_cli.api.exporting import export_file
from excite_cli.api.identifying import identify
from excite_cli.api.loading import Case, load_case, load_data, measured_case, problem_of
from excite_cli.api.planning import Planned, PlanProgress, plan, plan_after
from excite_cli.api.simulating import simulate
from excite_cli.atomic import write_text_atomically
from excite_cli.campaign.command import Command as Command
from excite_cli.campaign.ending import ended, still_open
from excite_cli.campaign.folder import STATE, read_campaign, write_campaign
from excite_cli.campaign.inbox import Inbox as Inbox
from excite_cli.campaign.measure import Measure as Measure
from excite_cli.campaign.measure import NotMeasuredError, Take
from excite_cli.campaign.records import Asked as Asked
from excite_cli.campaign.records import Campaign as Campaign
from excite_cli.campaign.records import Learned, PlayedMotion, Purpose, Round
from excite_cli.campaign.same_motion import compared
from excite_cli.campaign.schedule import looked_for, pace_of
from excite_cli.claim import claim, leave
from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.load import parse_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.errors import ExciteError, FileError, NoAdmissibleMotionError
from excite_cli.excitation.extension import why_not_planned
from excite_cli.excitation.invariant import design_for, invariants
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.measurement.motion_files import read_own_motion
from excite_cli.report.page import render
from excite_cli.report.rounds_page import rounds_page
from excite_cli.robot.model import Robot
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.result_file import read_result
from excite_cli.store.versions import versions
from excite_cli.summary.campaign import campaign_answer as campaign_answer
from excite_cli.summary.campaign import round_in_words
from excite_cli.summary.motions import motion_sentence
from excite_cli.summary.named_effects import what_and_where
from excite_cli.workers.base import Workers

PAGE, MODEL = "campaign.html", "model.yaml"
_OF_DATA = ("measurement", "identification", "diagnosis")
_FEWEST = 3  # motions of the first round: two are fitted, so that names rest on more than one


@dataclass(frozen=True)
class Simulated(Measure):
    """A MuJoCo robot in place of a real one: with `effects` that the config need not know."""

    case: Case
    effects: tuple[str, ...] = ()
    settings: SimulationSettings = field(default_factory=SimulationSettings)
    suffix: str = ".h5"

    def take(self, take: Take) -> None:
        """Play the motion and record it."""
        simulate(
            self.case, take.motion, self.effects, self.settings, output=take.data, overwrite=True
        )


@checked()
def run_campaign(
    case: Case,
    measure: Measure,
    folder: str | Path,
    asked: Asked = Asked(),
    *,
    retries: int = 2,
    resume: bool = False,
    workers: Workers | None = None,
    progress: PlanProgress = lambda motion, progress: None,
    tell: Tell = log_note,
) -> Campaign:
    """Rounds of motions, measured by `measure`, until nothing that matters is left.

    Everything is kept in `folder` after every step; `resume` goes on there, to the same end, and
    nothing that was measured is measured again. A motion that could not be measured, or whose log
    is that of another motion or robot, is tried `retries` more times.

    Returns
    -------
    Campaign
        `rounds` with what was played and learned, `ended` (`complete`, `budget` or `stuck`) and the
        `reason` in words. The model is in model.yaml, the evidence in the diagnosis of each round.

    Raises
    ------
    NotMeasuredError
        A motion was not measured; everything before it is kept.
    FileError
        The folder holds another campaign, or none to resume; another run is writing it.
    NoAdmissibleMotionError
        No motion within all constraints was found.
    """
    place = Path(folder)
    with _held(place):
        state = _begun(case, place, asked, resume)
        # What the campaign began with counts, whatever became of the file since.
        case = replace(case, spec=parse_spec(state.config, str(place / STATE)))
        own = _Loop(case, measure, place, retries, workers, progress, tell)
        while not state.ended:
            state = own.step(state)
            write_campaign(place, state)
            own.write_page(state)
    return state


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    claim(folder / STATE)
    try:
        yield
    finally:
        leave(folder / STATE)


def _begun(case: Case, folder: Path, asked: Asked, resume: bool) -> Campaign:
    config = spec_as_yaml(case.spec)
    if (folder / STATE).exists() and not resume:
        raise FileError(
            f"{folder} holds a campaign already. Go on with --resume, or give another folder with "
            "-o."
        )
    if not resume:
        whose = case.robot.fingerprint()
        new = Campaign(config, str(case.folder), whose, asked, versions=versions())
        write_campaign(folder, new)
        return new
    state = read_campaign(folder)
    before = parse_spec(state.config, str(folder / STATE))
    if state.fingerprint != case.robot.fingerprint() or _planning(before) != _planning(case.spec):
        raise FileError(
            f"the config is not the one that the campaign in {folder} began with: only what it "
            "says of the data (measurement, identification, diagnosis) may change. Put it back, or "
            "begin in another folder with -o."
        )
    budget = replace(state.asked, most_rounds=asked.most_rounds, most_seconds=asked.most_seconds)
    return replace(state, config=config, asked=budget, ended="", reason="")


def _planning(spec: Spec) -> Spec:
    """What of a config motions depend on."""
    plain = {
        name: Spec.model_fields[name].get_default(call_default_factory=True) for name in _OF_DATA
    }
    return spec.model_copy(update=plain)


@dataclass(frozen=True)
class _Loop:
    """What one step of a campaign needs."""

    case: Case
    measure: Measure
    folder: Path
    retries: int
    workers: Workers | None
    progress: PlanProgress
    tell: Tell

    def step(self, state: Campaign) -> Campaign:
        """The campaign after its next step: a plan, a motion measured, a diagnosis, its end."""
        last = state.rounds[-1] if state.rounds else None
        if last is None:
            return state.with_round(self._first(state))
        if last.missing is not None:
            return state.with_round(last.with_motion(self._measured(state, last, last.missing)))
        if last.learned is None:
            state = state.with_round(replace(last, learned=self._learned(state, last)))
            return ended(state, self._until)
        state = ended(state, self._until)
        return state if state.ended else state.with_round(self._next(state, last.number + 1))

    @property
    def _until(self) -> float | None:
        until = self.case.spec.sequence.until
        return None if until is None else until.torque_deviation

    def write_page(self, state: Campaign) -> None:
        """The page of all rounds, as far as they are."""
        page = rounds_page(state, self.case.robot.name)
        write_text_atomically(self.folder / PAGE, render(page))

    def _first(self, state: Campaign) -> Round:
        count = max(self.case.spec.sequence.motions or _FEWEST, _FEWEST)
        pace = pace_of(1, state.asked.from_speed)
        problem = self._problem(_at(pace, self.case.spec), 1, count)
        path = self.folder / "round_1.h5"
        self._say(f"round 1: {count} motions")
        result = self._planned(problem, path)
        motions = self._motions(1, "first", path, result, pace)
        return Round(1, motions, efficiency=_efficiency(problem, result))

    def _next(self, state: Campaign, number: int) -> Round:
        """A motion for what is known, and one for what is not."""
        found = self.folder / self._diagnosis(number - 1)
        pace = pace_of(number, state.asked.from_speed)
        spec = _at(pace, self._with_fit(state))
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
            self._say(f"round {number}: a motion that shows {len(unseen)} effects nobody has found")
            logs = [self.folder / each.data for each in state.motions]
            result = self._planned(problem, path, logs)
            motions += self._motions(number, "explore", path, result, pace, len(motions))
        return Round(number, motions, efficiency=efficiency)

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
            tell=self._warn,
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

    def _measured(self, state: Campaign, last: Round, motion: PlayedMotion) -> PlayedMotion:
        """The motion with its log, which is whole and of that motion."""
        path = self.folder / f"{motion.name}.csv"
        exported = export_file(
            self.folder / motion.plan,
            "csv",
            path,
            chosen=(motion.index,),
            slow=motion.pace if motion.pace < 1.0 else None,
            start={} if state.asked.entry else None,
            overwrite=True,
            tell=lambda note: None,
        ).motions[0]
        motion = replace(motion, pace=min(motion.pace, exported.pace), seconds=exported.duration)
        self._require_admissible(motion, path)
        log = self.folder / f"{motion.name}_log{self.measure.suffix}"
        take = Take(motion.name, path, log, motion.seconds, log.with_suffix(".txt"))
        self.measure.settle(take)
        self._say(f"{motion.name}: {motion.seconds:.1f} s at {motion.pace:.0%} of its pace")
        why = ""
        for _ in range(self.retries + 1):
            try:
                if not log.exists():  # it is there if the campaign was killed just then
                    self.measure.take(take)
                why = self._no_log_of(path, log)
            except NotMeasuredError as error:
                why = str(error)
            if not why:
                return replace(motion, data=log.name)
            motion = replace(motion, rejected=(*motion.rejected, why))
            where = _set_aside(log)
            self.tell(Note(Level.WARNING, why + (f" Set aside: {where}." if where else "")))
        raise NotMeasuredError(
            f"{motion.name} was not measured in {self.retries + 1} tries: {why} Everything before "
            "it is kept: see to the cause, then go on with --resume."
        )

    def _require_admissible(self, motion: PlayedMotion, path: Path) -> None:
        """What is played keeps every constraint, slowed and with its ways, by an own check.

        For the inertias that were possible when it was planned.
        """
        plan_of = read_result(self.folder / motion.plan).config
        planned = parse_spec(plan_of, f"the config stored in {motion.plan}")
        spec = self.case.spec.model_copy(update={"uncertainty": planned.uncertainty})
        problem = problem_of(replace(self.case, spec=spec), lambda note: None)
        found = check(problem, path, meshes=False, tell=lambda note: None)
        if found.violations:
            raise NoAdmissibleMotionError(
                f"{path} would break {found.violations} constraints, and is not played: "
                f"`excite check` says which. Slowed motions need other torques: raise --from-speed."
            )

    def _no_log_of(self, motion: Path, log: Path) -> str:
        """Why a file is no log of a motion of this robot; empty if it is one."""
        try:
            data = load_data(self.case, log, lambda note: None)
        except ExciteError as error:
            return f"{log.name} is no log of this robot: {error}"
        read = read_own_motion(motion)
        planned = read.t, read.q
        own = slice(measured_case(self.case).robot.base_joints, None)
        for run in data.runs:
            found = compared(planned, (run.t, run.q[:, own]), data.joint_names[own])
            if found.reason:
                return f"{log.name} is no log of {motion.stem}: {found.reason}."
        return ""

    def _learned(self, state: Campaign, last: Round) -> Learned:
        path = self.folder / self._diagnosis(last.number)
        logs = [self.folder / each.data for each in state.motions]
        self._say(f"round {last.number}: diagnosis of {len(logs)} logs")
        found = diagnose(
            self.case,
            logs,
            output=path,
            overwrite=True,
            workers=self.workers,
            tell=self._warn,
        )
        save_config(self.folder / MODEL, self.case, found, unconfirmed=True)
        following = plan_after(self.case, found, tell=lambda note: None)
        separation = following.problem.separation
        pairs = (
            ()
            if separation is None
            else tuple(" or ".join(each.pair) for each in separation.directions[::2])
        )
        count, model = len(found.joint_names), following.model
        known = invariants(model, following.prior)
        learned = Learned(
            found.begins.mean_relative_moving,
            found.after.mean_relative_moving,
            tuple(what_and_where(each.effect, count) for each in found.effects),
            still_open(found, pairs),
            pairs,
            known.torque_deviation,
        )
        self._say(round_in_words(last.number, learned))
        return learned

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

    def _diagnosis(self, number: int) -> str:
        return f"round_{number}_diagnosis.h5"

    def _say(self, text: str) -> None:
        self.tell(Note(Level.INFO, text))

    def _warn(self, note: Note) -> None:
        """What a step says is told where it matters beyond that step."""
        if note.level is Level.WARNING:
            self.tell(note)


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


def _at(pace: float, spec: Spec) -> Spec:
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
        stack = stack.with_rows(objective.block(motion.coefficients))
    return invariants(problem, stack, design_for(problem)).efficiency


def _set_aside(log: Path) -> Path | None:
    """Give a file that is no log another name, for who wants to see it."""
    if not log.exists():
        return None
    number = 1
    while (to := log.with_name(f"{log.stem}_rejected_{number}{log.suffix}")).exists():
        number += 1
    return log.rename(to)
