"""A program of the user's that plays a motion on the robot and writes its log."""

import os
import re
import shlex
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

from excite_cli.campaign.measure import Measure, NotMeasuredError, Take
from excite_cli.campaign.one_at_a_time import held_while_it_runs
from excite_cli.errors import ConfigError

_PLACES = ("{motion}", "{data}")
_GRACE = 10.0  # s to stop the robot in, between being told to end and being ended
_TIMES, _MORE = 5.0, 60.0  # the limit of time: so many times the motion, and so many seconds


@dataclass(frozen=True)
class Command(Measure):
    """Runs `words`, in which {motion} and {data} become whole paths, {name} the motion's name.

    No shell is between. Exit status 0 means measured. `limit` [s]; None: five times the motion and
    a minute.
    """

    words: tuple[str, ...]
    suffix: str = ".csv"
    limit: float | None = None

    @classmethod
    def of(cls, text: str, suffix: str = ".csv", limit: float | None = None) -> "Command":
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
        return cls(words, suffix, limit)

    def settle(self, take: Take) -> None:
        """Wait for the program of a campaign that was killed, which may still move the robot."""
        with held_while_it_runs(take.diary.parent, self._limit(take)):
            pass

    def _limit(self, take: Take) -> float:
        return self.limit or _TIMES * take.seconds + _MORE

    def take(self, take: Take) -> None:
        """Run the program to its end, or to the limit of time: SIGTERM, and SIGKILL after 10 s."""
        # Whole paths: none begins with a minus, and each holds wherever the program goes.
        motion, data = (str(path.absolute()) for path in (take.motion, take.data))
        given = {"{motion}": motion, "{data}": data, "{name}": take.name}
        words = [_filled(word, given) for word in self.words]
        limit = self._limit(take)
        with held_while_it_runs(take.diary.parent, limit) as handle, take.diary.open("ab") as diary:
            try:
                process = subprocess.Popen(
                    words,
                    stdin=subprocess.DEVNULL,
                    stdout=diary,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    pass_fds=(handle,),
                )
            except OSError as error:
                raise NotMeasuredError(
                    f"{take.name}: '{words[0]}' cannot be run: {error.strerror}. Give --measure a "
                    "program that is on the path, or its whole path."
                ) from error
            try:
                status = process.wait(limit)
            except subprocess.TimeoutExpired:
                _end(process)
                raise NotMeasuredError(
                    f"{take.name}: the program was still running after {limit:.0f} s (the motion "
                    f"takes {take.seconds:.0f} s) and was ended. Allow more with --timeout. "
                    f"{_last_words(take.diary)}"
                ) from None
            except BaseException:  # the campaign is told to end: so is the robot
                _end(process)
                raise
        if status:
            what = f"signal {-status}" if status < 0 else f"exit status {status}"
            raise NotMeasuredError(
                f"{take.name}: the program ended with {what}. {_last_words(take.diary)}"
            )
        if not take.data.exists():
            raise NotMeasuredError(
                f"{take.name}: the program ended well but wrote no {take.data}. It must write its "
                "log where {data} says. " + _last_words(take.diary)
            )


def _filled(word: str, given: dict[str, str]) -> str:
    """The word with its places filled, in one pass: what is put in may look like a place."""
    places = "|".join(map(re.escape, given))
    return re.sub(places, lambda found: given[found[0]], word)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Tell the program and all that it started to end; after a while, end them."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
        except ProcessLookupError:
            return
        try:
            process.wait(_GRACE)
            return
        except subprocess.TimeoutExpired:
            continue


def _last_words(diary: Path) -> str:
    """The last line of what the program said, and where all of it is."""
    said = diary.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    last = f"Its last line: {said[-1][-300:]}. " if said else "It said nothing. "
    return f"{last}All of it: {diary}"
