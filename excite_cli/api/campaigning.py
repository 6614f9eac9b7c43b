"""Plan, have it measured, diagnose, plan the next: `excite campaign`.

Every round plays a motion for what is known (it separates effects that could be each other, else
excites the model with all effects found) and one that makes visible what nobody has found yet. The
newest motion takes no part in the diagnosis: what the model misses there is the campaign's error;
from the next round on it is one of those that the model is fitted to.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.campaign_plans import MODEL, RoundPlans, diagnosis_of, warnings_only
from excite_cli.api.campaign_takes import Takes
from excite_cli.api.diagnosing import diagnose, save_config
from excite_cli.api.loading import Case
from excite_cli.api.planning import PlanProgress, plan_after
from excite_cli.api.simulating import PositionDrive, simulate
from excite_cli.atomic import write_text_atomically
from excite_cli.campaign.inbox import Inbox as Inbox
from excite_cli.campaign.measure import Measure as Measure
from excite_cli.campaign.measure import Take
from excite_cli.campaign.measure_command import MeasureCommand as MeasureCommand
from excite_cli.campaign.records import (
    STATE,
    CampaignRound,
    RoundFindings,
    read_campaign,
    write_campaign,
)
from excite_cli.campaign.records import Campaign as Campaign
from excite_cli.campaign.records import CampaignOptions as CampaignOptions
from excite_cli.campaign.stopping_rule import ended, still_open
from excite_cli.claim import claim, leave
from excite_cli.config.load_spec import parse_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.invariant import invariants
from excite_cli.measurement.torque import given_law
from excite_cli.report.page import render
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.own_file import versions
from excite_cli.summary.campaign import campaign_answer as campaign_answer
from excite_cli.summary.campaign import round_in_words, rounds_page
from excite_cli.summary.named_effects import what_and_where
from excite_cli.workers.base import Workers

PAGE = "campaign.html"
_OF_DATA = ("measurement", "identification", "diagnosis")


@dataclass(frozen=True)
class Simulated(Measure):
    """A MuJoCo robot in place of a real one: with `effects` that the config need not know.

    Where the config says that set points are measured (`measurement.torque: command`), it has the
    config's drives, with set points that lead the motion.
    """

    case: Case
    effects: tuple[str, ...] = ()
    settings: SimulationSettings = field(default_factory=SimulationSettings)
    suffix: str = ".h5"

    def take(self, take: Take) -> None:
        """Play the motion and record it.

        Raises
        ------
        ConfigError
            The config takes torques from set points, but gives no gains of the drives.
        """
        settings, measurement = self.settings, self.case.spec.measurement
        if settings.drive is None and measurement.torque == "command":
            law = given_law(measurement, self.case.robot.joint_names, "--measure simulate")
            speeds = measurement.command.set_point_speeds
            settings = replace(settings, drive=PositionDrive.of_law(law, speeds, lead=True))
        simulate(self.case, take.motion, self.effects, settings, output=take.data, overwrite=True)


@checked()
def run_campaign(
    case: Case,
    measure: Measure,
    folder: str | Path,
    asked: CampaignOptions = CampaignOptions(),
    *,
    retries: int = 2,
    resume: bool = False,
    workers: Workers | None = None,
    progress: PlanProgress = unheard,
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
    ConfigError
        `sequence.until` asks for the power of effects.
    FileError
        The folder holds another campaign, or none to resume; another run is writing it; a motion
        is not the one that was proved.
    NoAdmissibleMotionError
        No motion within all constraints was found.
    """
    place, until = Path(folder), case.spec.sequence.until
    if until is not None and until.power:
        raise ConfigError(
            "sequence.until.power: a campaign plans until nothing is open, and does not end by "
            "sizes of effects. Leave it out, or plan with `excite optimize`."
        )
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


def _begun(case: Case, folder: Path, asked: CampaignOptions, resume: bool) -> Campaign:
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
            return state.with_round(self._plans.first(state))
        if last.missing is not None:
            takes = Takes(self.case, self.measure, self.folder, self.retries, self.tell)
            return state.with_round(last.with_motion(takes.measured(state, last.missing)))
        if last.learned is None:
            state = state.with_round(replace(last, learned=self._learned(state, last)))
            return ended(state, self._until)
        state = ended(state, self._until)
        return (
            state
            if state.ended
            else state.with_round(self._plans.following(state, last.number + 1))
        )

    @property
    def _until(self) -> float | None:
        until = self.case.spec.sequence.until
        return None if until is None else until.predicted_deviation or until.torque_deviation

    def write_page(self, state: Campaign) -> None:
        """The page of all rounds, as far as they are."""
        done = {
            f"diagnosis of round {each.number}": diagnosis_of(each.number)
            for each in state.rounds
            if each.learned is not None
        }
        newest = self.folder / next(reversed(done.values())) if done else None
        files = {"config with the effects found": MODEL, **done} if done else {}
        last = read_diagnosis(newest) if newest is not None and newest.exists() else None
        page = rounds_page(state, self.case.robot.name, files, last)
        write_text_atomically(self.folder / PAGE, render(page))

    def _learned(self, state: Campaign, last: CampaignRound) -> RoundFindings:
        path = self.folder / diagnosis_of(last.number)
        logs = [self.folder / each.data for each in state.motions]
        what = f"round {last.number}: diagnosing {len(logs)} logs"
        self._say(what)
        self.tell(Note(Level.STEP, "", what))
        found = diagnose(
            self.case,
            logs,
            output=path,
            overwrite=True,
            workers=self.workers,
            progress=lambda text, done: self.tell(Note(Level.STEP, text)),
            tell=warnings_only(self.tell),
        )
        self.tell(Note(Level.STEP, "", f"round {last.number}: what the next motion is for"))
        save_config(self.folder / MODEL, self.case, found, unconfirmed=True)
        following = plan_after(self.case, found, tell=unheard)
        separation = following.problem.separation
        pairs = (
            ()
            if separation is None
            else tuple(" or ".join(each.pair) for each in separation.directions[::2])
        )
        count, model = len(found.joint_names), following.model
        deviation = invariants(model, following.prior).torque_deviation
        until = self.case.spec.sequence.until
        if until is not None and until.predicted_deviation is not None and following.known:
            problem, data = following.known
            assert problem.prediction is not None
            deviation = problem.prediction.deviation(data.factor)
        learned = RoundFindings(
            found.baseline.mean_relative_moving,
            found.after.mean_relative_moving,
            tuple(what_and_where(each.effect, count) for each in found.effects),
            still_open(found, pairs),
            pairs,
            deviation,
        )
        self._say(round_in_words(last.number, learned))
        return learned

    @property
    def _plans(self) -> RoundPlans:
        return RoundPlans(self.case, self.folder, self.workers, self.progress, self.tell)

    def _say(self, text: str) -> None:
        self.tell(Note(Level.INFO, text))
