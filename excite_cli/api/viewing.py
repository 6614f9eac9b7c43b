"""Motions on the robot, in the browser or as a picture: `excite view`."""

import webbrowser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked, existing, paths_in
from excite_cli.api.loading import load_problem, rebuilt_problem
from excite_cli.api.motions import Motions, load_motions, motions_of, tell_doubts
from excite_cli.api.outputs import held
from excite_cli.atomic import write_atomically
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.inspection import not_modelled
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.shown.answer import Answer
from excite_cli.shown.note import Level, Note, Tell, log_note, saying, unheard
from excite_cli.store.diagnosis_file import is_diagnosis
from excite_cli.store.fit_file import is_fit
from excite_cli.store.result_file import is_result, read_result
from excite_cli.summary.pairs import not_modelled_in_words
from excite_cli.trajectory.fade import Segment
from excite_cli.view.browser import Serving as Serving
from excite_cli.view.browser import play_in_browser
from excite_cli.view.pictures import View as View
from excite_cli.view.pictures import frame_count, motion_gif, still_png
from excite_cli.workers.base import Workers

_SECONDS = 5.0  # of a GIF, unless the motion is shorter
_GIF_SIZE = (640, 480)
_SMALLEST, _LARGEST = 16, 4096  # pixels


@dataclass(frozen=True)
class Drawing:
    """A picture that was written: `size` in bytes; of a GIF its frames and its length [s].

    `not_modelled`: what is not in the picture, although it may be around the robot.
    """

    path: Path
    motion: str
    size: int
    frames: int | None = None
    seconds: float | None = None
    not_modelled: tuple[str, ...] = ()


@checked("motions")
def view_motions(
    motions: Motions,
    config: Problem | str | Path | None = None,
    overrides: Sequence[str] = (),
    *,
    chosen: Sequence[int] = (),
    serving: Serving = Serving(),
    browser: bool = True,
    ready: Callable[[str, int], None] | None = None,
    tell: Tell = log_note,
) -> None:
    """Play motions on the robot in the browser, until Ctrl-C: `excite view`.

    `motions` are a result, or anything that `load_motions` takes; `chosen` of a result's by their
    index. `config`, a problem or its YAML file, says what moves; a result knows it, and needs the
    file only to find a relative URDF. `serving` says where, and what is shown at first.
    `ready(url, port)` is called when the page can be opened; the `browser` then opens it.

    Raises
    ------
    FileError, ConfigError
        The motions cannot be read, or are none; the robot is not known; the port cannot be used.
    MissingExtraError
        viser is not installed.
    """
    problem, segments = _on_their_robot(motions, config, overrides, chosen, tell)

    def served(url: str, port: int) -> None:
        if port != serving.port:
            text = f"Port {serving.port} is taken; {port} is the next free one."
            tell(Note(Level.INFO, text))
        if ready is not None:
            ready(url, port)
        if browser:
            webbrowser.open(url)

    try:
        play_in_browser(problem, segments, serving, served, say=saying(tell))
    except KeyboardInterrupt:  # the way to end it, and no error
        tell(Note(Level.INFO, "Ended."))


@checked("motions")
def draw_motion(
    motions: Motions,
    output: str | Path,
    config: Problem | str | Path | None = None,
    overrides: Sequence[str] = (),
    *,
    chosen: Sequence[int] = (),
    look: View | None = None,
    time: float | None = None,
    fps: float = 12.0,
    seconds: float | None = None,
    overwrite: bool = False,
    progress: Callable[[str, int, int], None] = unheard,
    workers: Workers | None = None,
    tell: Tell = log_note,
) -> Drawing:
    """Draw a motion without a display: `excite view --png`, `excite view --gif`.

    NAME.png is the instant `time` [s], by default the one at which the robot comes nearest to
    itself or to what stands around it; NAME.gif the whole motion, `seconds` long (by default its
    own length, 5 s at most), with `fps` frames per second. Of several motions the first is drawn.
    `motions`, `config` and `chosen` are those of `view_motions`; `look` says from where, how large,
    and what is shown (PNG: 1280 x 960 pixels, GIF: 640 x 480). `workers` (`open_workers`) share the
    frames of a GIF.

    Raises
    ------
    FileError, ConfigError
        The motions cannot be read, or are none; the robot is not known; `output` has another
        suffix, or exists already; the motion ends before `time`; size, frames or length cannot be.
    MissingExtraError
        embreex or Pillow is not installed.
    """
    path = Path(output)
    if isinstance(motions, str | Path):
        existing(motions)
    suffix = path.suffix.lower()
    if suffix not in (".png", ".gif"):
        raise FileError(f"{path}: give a name that ends in .png or .gif.")
    if look is not None:
        _check_size(look.size)
    with held({suffix[1:]: path}, overwrite, paths_in(motions, config)):
        problem, segments = _on_their_robot(motions, config, overrides, chosen, tell)
        segment = segments[0]
        duration = segment.trajectory.duration
        if time is not None and time > duration:
            raise ConfigError(f"--time {time:g}: {segment.name} ends at {duration:g} s.")
        film = None if suffix == ".png" else _Film(fps, seconds or min(_SECONDS, duration))
        if film is None:
            content = still_png(problem, segment, look, time, saying(tell))
        else:
            content = film.drawn(problem, segment, look, progress, workers, tell)
        write_atomically(path, lambda temporary: temporary.write_bytes(content))
    return Drawing(
        path,
        segment.name,
        len(content),
        None if film is None else film.frames,
        None if film is None else film.seconds,
        not_modelled(problem),
    )


@dataclass(frozen=True)
class _Film:
    """The length [s] of a GIF, and its frames per second."""

    fps: float
    seconds: float

    def __post_init__(self) -> None:
        """Raise ConfigError for what cannot be."""
        if not 1.0 <= self.fps <= 50.0:
            raise ConfigError(f"--fps {self.fps:g}: give 1 to 50 frames per second.")
        if not 0.0 < self.seconds <= 120.0:
            raise ConfigError(f"--duration {self.seconds:g}: give a length up to 120 s.")

    @property
    def frames(self) -> int:
        return frame_count(self.fps, self.seconds)

    def drawn(
        self,
        problem: Problem,
        segment: Segment,
        look: View | None,
        progress: Callable[[str, int, int], None],
        workers: Workers | None,
        tell: Tell,
    ) -> bytes:
        return motion_gif(
            problem,
            segment,
            look or View(size=_GIF_SIZE),
            self.fps,
            self.seconds,
            lambda text, done: progress(text, done, self.frames),
            saying(tell),
            workers,
        )


def drawing_answer(found: Drawing) -> Answer:
    """What `excite view --png` and `--gif` answer: the file."""
    data: dict[str, Any] = {"picture": str(found.path), "motion": found.motion}
    data |= {"bytes": found.size, "not_modelled": list(found.not_modelled)}
    if found.frames is not None:
        data |= {"frames": found.frames, "seconds": found.seconds}
    said = [not_modelled_in_words(found.not_modelled)] if found.not_modelled else []
    return Answer((str(found.path), *said), data)


def _check_size(size: tuple[int, int]) -> None:
    if not _SMALLEST <= min(size) <= max(size) <= _LARGEST:
        raise ConfigError(
            f"--size {size[0]}x{size[1]}: give WIDTHxHEIGHT in pixels, {_SMALLEST} to {_LARGEST}: "
            "1280x960."
        )


def _on_their_robot(
    motions: Motions,
    config: Problem | str | Path | None,
    overrides: Sequence[str],
    chosen: Sequence[int],
    tell: Tell,
) -> tuple[Problem, list[Segment]]:
    """The problem, and the motions to be shown."""
    name, result = "the result", motions if isinstance(motions, Result) else None
    if isinstance(motions, str | Path):
        name, path = str(motions), existing(motions)
        result = read_result(path) if is_result(path) else None
    if result is not None and not isinstance(config, Problem):
        if overrides:
            raise ConfigError("--set: a result file has its own config; leave it out.")
        tell_doubts(result, name, tell)
        return rebuilt_problem(result, config, name), motions_of(result, chosen, name)
    if config is None:
        raise FileError(_unknown_robot(motions))
    problem = config if isinstance(config, Problem) else load_problem(config, overrides, tell)
    segments = load_motions(problem, motions, chosen, tell)
    if not segments:
        raise FileError("There is no motion to show.")
    return problem, segments


def _unknown_robot(motions: Motions) -> str:
    if not isinstance(motions, str | Path):
        return "these motions do not say which robot moves: give the problem, or its config."
    path = Path(motions)
    if path.is_file() and (is_fit(path) or is_diagnosis(path)):
        read_result(path)  # tells that these are no motions
    return f"{path} is not a result file, so the robot is not known: give --config CONFIG.yaml."
