"""A motion of a campaign is measured: checked as it is played, and its log checked against it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from excite_cli.api.checking import check
from excite_cli.api.exporting import export_file
from excite_cli.api.loading import Case, load_data, measured_case, problem_of
from excite_cli.campaign.measure import Measure, NotMeasuredError, StillRunningError, Take
from excite_cli.campaign.records import Campaign, PlayedMotion
from excite_cli.campaign.same_motion import (
    compared,
    is_measured,
    record_measured,
    record_of,
    same_file,
)
from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ExciteError, FileError, NoAdmissibleMotionError
from excite_cli.motion_formats.catalogue import read_own_motion
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.store.result_file import read_result
from excite_cli.summary.pairs import doubts_in_words

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Takes:
    """Has motions of the campaign in `folder` measured, each with `retries` further tries."""

    case: Case
    measure: Measure
    folder: Path
    retries: int
    tell: Tell

    def measured(self, state: Campaign, motion: PlayedMotion) -> PlayedMotion:
        """The motion with its log, which is whole and of that motion.

        Raises
        ------
        NotMeasuredError
            There is none after all tries, or something that moves the robot could not be ended.
        NoAdmissibleMotionError
            The motion as it would be played breaks a constraint.
        FileError
            It is not the motion that was proved.
        """
        self._step(motion, "checking the motion as it is played")
        motion, path = self._exported(state, motion)
        log = self.folder / f"{motion.name}_log{self.measure.suffix}"
        used = [self.folder / each.data for each in state.motions]
        refused = partial(self._no_log_of, path, used, _silent)
        take = Take(motion.name, path, log, motion.seconds, log.with_suffix(".txt"), refused)
        self.measure.wait_for_earlier(take)
        speed = f"with {motion.pace:.0%} of the limits of speed, acceleration and jerk"
        text = f"{motion.name}: measuring a motion of {motion.seconds:.1f} s, {speed}"
        self.tell(Note(Level.INFO, text))
        if log.exists() and not is_measured(log):  # the campaign was killed, or its program failed
            why = (
                f"{log.name} may be half a log: no record says that what measured it has ended "
                "well. The motion is measured anew."
            )
            motion = self._rejected(motion, log, why)
        why = ""
        for _ in range(self.retries + 1):
            self._step(motion, f"measuring (a motion of {motion.seconds:.0f} s)")
            why = self._taken(take)
            self._step(motion, "checking the log")
            why = why or self._no_log_of(path, used, self.tell, log)
            if not why:
                return replace(motion, data=log.name)
            motion = self._rejected(motion, log, why)
        raise NotMeasuredError(
            f"{motion.name} was not measured in {self.retries + 1} tries: {why} Everything before "
            "it is kept: see to the cause, then go on with --resume."
        )

    def _step(self, motion: PlayedMotion, what: str) -> None:
        self.tell(Note(Level.STEP, "", f"{motion.name}, {what}"))

    def _exported(self, state: Campaign, motion: PlayedMotion) -> tuple[PlayedMotion, Path]:
        """The motion as it will be played, and its file, by an own check admissible."""
        self._require_proved(motion)
        path = self.folder / f"{motion.name}.csv"
        slow = motion.pace / self._planned_pace(motion)
        exported = export_file(
            self.folder / motion.plan,
            "csv",
            path,
            chosen=(motion.index,),
            slow=slow if slow < 1.0 - _ROUNDING else None,
            start={} if state.asked.entry else None,
            overwrite=True,
            tell=_silent,
        ).motions[0]
        motion = replace(motion, pace=min(motion.pace, exported.pace), seconds=exported.duration)
        self._require_admissible(motion, path)
        return motion, path

    def _planned_pace(self, motion: PlayedMotion) -> float:
        """Share of the limits that it was planned to keep, of those of the campaign's config."""
        stored = parse_spec(read_result(self.folder / motion.plan).config, f"{motion.plan}")
        planned, own = stored.constraints.joint_limits, self.case.spec.constraints.joint_limits
        return planned.pace / own.pace if planned is not None and own is not None else 1.0

    def _taken(self, take: Take) -> str:
        """Have a take measured, unless it was before the campaign was killed; why it was not."""
        if take.data.exists():
            return ""
        try:
            self.measure.take(take)
        except StillRunningError:
            raise
        except NotMeasuredError as error:
            return str(error)
        if take.data.exists() and not is_measured(take.data):
            record_measured(take.data)
        return ""

    def _rejected(self, motion: PlayedMotion, log: Path, why: str) -> PlayedMotion:
        """The motion with a take that was no log of it, whose file is set aside."""
        where = _set_aside(log)
        self.tell(Note(Level.WARNING, why + (f" Set aside: {where}." if where else "")))
        return replace(motion, rejected=(*motion.rejected, why))

    def _require_proved(self, motion: PlayedMotion) -> None:
        """What is played is the motion that was planned and proved, as it was then."""
        plan = self.folder / motion.plan
        read = read_result(plan)
        words = doubts_in_words([each for each in read.doubted() if each.index == motion.index])
        if words:
            raise FileError(
                f"{plan}: {words[0]}. A campaign plays no such motion: put the file back as it "
                "was and go on with --resume, or begin in another folder with -o."
            )

    def _require_admissible(self, motion: PlayedMotion, path: Path) -> None:
        """What is played keeps every constraint, slowed and with its ways, by an own check.

        For the inertias that were possible when it was planned.
        """
        plan_of = read_result(self.folder / motion.plan).config
        planned = parse_spec(plan_of, f"the config stored in {motion.plan}")
        spec = self.case.spec.model_copy(update={"uncertainty": planned.uncertainty})
        problem = problem_of(replace(self.case, spec=spec), _silent)
        found = check(problem, path, meshes=False, tell=_silent)
        if found.violations:
            raise NoAdmissibleMotionError(
                f"{path} would break {found.violations} constraints, and is not played: "
                f"`excite check` says which. Slowed motions need other torques: raise --from-speed."
            )

    def _no_log_of(
        self,
        motion: Path,
        used: Sequence[Path],
        tell: Tell,
        log: Path,
        since: float | None = None,
    ) -> str:
        """Why a file is no log of a motion of this robot; empty if it is one.

        `used`: logs of other motions. `since` [s from 1970]: before that no recording of it ended.
        `tell` hears what is doubtful.
        """
        if (same := same_file(log, used)) is not None:
            return (
                f"{log.name} is no log of {motion.stem}: {log.name} is a copy of {same.name}, "
                "byte for byte, the log of another motion."
            )
        try:
            data = load_data(self.case, log, _silent)
        except ExciteError as error:
            return f"{log.name} is no log of this robot: {error}"
        read = read_own_motion(motion)
        planned = read.t, read.q
        own = slice(measured_case(self.case).robot.base_joints, None)
        for run in data.runs:
            if since is not None and run.epoch is not None and run.epoch + run.t[-1] < since:
                return (
                    f"its time stamps end {since - run.epoch - run.t[-1]:.0f} s before the motion "
                    "was written: the file is an older recording."
                )
            found = compared(planned, (run.t, run.q[:, own]), data.joint_names[own])
            if found.reason:
                return f"{log.name} is no log of {motion.stem}: {found.reason}."
            if found.doubt:
                tell(Note(Level.WARNING, f"{log.name}: {found.doubt}."))
        return ""


def _silent(note: Note) -> None:
    """What is said elsewhere."""


def _set_aside(log: Path) -> Path | None:
    """Give a file that is no log another name, for who wants to see it."""
    if not log.exists():
        return None
    number = 1
    while (to := log.with_name(f"{log.stem}_rejected_{number}{log.suffix}")).exists():
        number += 1
    record_of(log).unlink(missing_ok=True)
    return log.rename(to)
