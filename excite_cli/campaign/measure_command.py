"""A program of the user's that plays a motion on the robot and writes its log."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from excite_cli.campaign.measure import Measure, NotMeasuredError, StillRunningError, Take
from excite_cli.campaign.supervised import (
    CannotRunError,
    Held,
    followed,
    held_signals,
    held_while_it_runs,
)
from excite_cli.campaign.supervisor import Job, ProgramExit
from excite_cli.errors import ConfigError
from excite_cli.shown.note import Level, Note, Tell, log_note, saying

_PLACES = ("{motion}", "{data}")
_GRACE = 10.0  # s to stop the robot in, from being asked to end (SIGTERM) to being ended (SIGKILL)
_TIMES, _MORE = 5.0, 60.0  # the limit of time: so many times the motion, and so many seconds


@dataclass(frozen=True)
class MeasureCommand(Measure):
    """Runs `words`, in which {motion} and {data} become whole paths, {name} the motion's name.

    No shell is between. Exit status 0 means measured. `limit` [s]; None: five times the motion and
    a minute. `grace` [s]: how long a program may take to stop the robot once it is asked to end,
    and what it leaves running after its own end. `tell` hears what is waited for.
    """

    words: tuple[str, ...]
    suffix: str = ".csv"
    limit: float | None = None
    tell: Tell = log_note
    grace: float = _GRACE

    @classmethod
    def of(
        cls,
        text: str,
        suffix: str = ".csv",
        limit: float | None = None,
        tell: Tell = log_note,
        grace: float = _GRACE,
    ) -> "MeasureCommand":
        """The command of a line as it is typed.

        Raises
        ------
        ConfigError
            It cannot be split into words, or does not say where motion and log are.
        """
        try:
            words = tuple(shlex.split(text))
        except ValueError as error:
            raise ConfigError(f"--measure {text!r}: {error}. Quote it as for a shell.") from error
        lacking = [place for place in _PLACES if not any(place in word for word in words)]
        if lacking:
            raise ConfigError(
                f"--measure {text!r}: {' and '.join(lacking)} is missing. The program is given the "
                "motion to play and the log to write: --measure 'python play.py {motion} {data}'."
            )
        if not suffix.startswith("."):
            raise ConfigError(f"--log {suffix}: write a suffix with its dot, as .csv or .h5.")
        return cls(words, suffix, limit, tell, grace)

    def wait_for_earlier(self, take: Take) -> None:
        """Wait for the program of a campaign that was killed, which may still move the robot."""
        with held_while_it_runs(take.diary.parent, self._limit(take), self.tell):
            pass

    def _limit(self, take: Take) -> float:
        return self.limit or _TIMES * take.seconds + _MORE

    def take(self, take: Take) -> None:
        """Run the program until nothing runs of it and of all that it started.

        At the limit of time, and where this process is asked to end, it is ended: SIGTERM, then
        SIGKILL after `grace`, or at once when asked again.
        """
        # Whole paths: none begins with a minus, and each holds wherever the program goes.
        motion, data = (str(path.absolute()) for path in (take.motion, take.data))
        given = {"{motion}": motion, "{data}": data, "{name}": take.name}
        words = tuple(_filled(word, given) for word in self.words)
        limit = self._limit(take)
        with held_while_it_runs(take.diary.parent, limit, self.tell) as handle:
            job = Job(words, str(take.data), limit, self.grace, handle)
            with take.diary.open("ab") as diary, held_signals() as held:
                ended = self._run(job, diary, held, take)
        if ended.alive:  # before all else, also before an interruption
            raise StillRunningError(
                f"still running: {ended.alive}, of the measuring program. The robot may move: stop "
                f"it by hand, then go on with --resume. {take.name} was not measured."
            )
        held.deliver()
        self._require_measured(take, ended)

    def _run(self, job: Job, diary: BinaryIO, held: Held, take: Take) -> ProgramExit:
        try:
            return followed(job, diary, held, saying(self.tell, Level.WARNING))
        except CannotRunError as error:
            raise NotMeasuredError(
                f"{take.name}: '{job.words[0]}' cannot be run: {error}. Give --measure a program "
                "that is on the path, or its whole path."
            ) from error

    def _require_measured(self, take: Take, ended: ProgramExit) -> None:
        """Raise where a program has not ended by itself, with status 0 and a log."""
        said = _last_words(take.diary)
        if ended.why == "limit":
            raise NotMeasuredError(
                f"{take.name}: the program was still running after {self._limit(take):.0f} s (the "
                f"motion takes {take.seconds:.0f} s) and was ended. Allow more with --timeout. "
                + said
            )
        if ended.why:
            how = "its supervisor was killed" if ended.why == "lost" else "a signal asked for that"
            raise NotMeasuredError(f"{take.name}: the program was ended, as {how}. {said}")
        if ended.status:
            status = ended.status
            what = f"signal {-status}" if status < 0 else f"exit status {status}"
            raise NotMeasuredError(f"{take.name}: the program ended with {what}. {said}")
        if not take.data.exists():
            raise NotMeasuredError(
                f"{take.name}: the program ended well but wrote no {take.data}. It must write its "
                "log where {data} says. " + said
            )
        if ended.fault:
            raise NotMeasuredError(f"{take.name}: {ended.fault}")
        if ended.left:
            text = (
                f"{take.name}: the program had left running, and excite has ended: {ended.left}. "
                "Let the program wait for all that it starts."
            )
            self.tell(Note(Level.WARNING, text))


def _filled(word: str, given: dict[str, str]) -> str:
    """The word with its places filled, in one pass: what is put in may look like a place."""
    places = "|".join(map(re.escape, given))
    return re.sub(places, lambda found: given[found[0]], word)


def _last_words(diary: Path) -> str:
    """The last line of what the program said, and where all of it is."""
    said = diary.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    last = f"Its last line: {said[-1][-300:]}. " if said else "It said nothing. "
    return f"{last}All of it: {diary}"
