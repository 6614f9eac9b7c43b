"""What to do after a command, by what was given and found: a sentence, and the command for it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from excite_cli.api.showing import Command, Part, as_word

if TYPE_CHECKING:
    from excite_cli.api.campaigning import Campaign
    from excite_cli.api.exporting import Exported
    from excite_cli.api.scoring import Score

_RECORD = "play the motion, record positions and torques, and"


def next_step(words: str, *command: str | Path) -> tuple[Part, ...]:
    """`Next: …`, and the words of a command of `excite`, paths as such."""
    if not command:
        return (f"Next: {words}.",)
    typed = (as_word(each) if isinstance(each, Path) else each for each in command)
    return f"Next: {words}:", Command(("excite", *typed))


def after_optimize(
    good: bool, config: Path, motions: Path, after: Path | None, fit: Path | None
) -> tuple[Part, ...]:
    """Once motions are planned: `after` a diagnosis, for a load on top of a `fit`, or the first."""
    if not good:
        return next_step(
            "allow more motion (sequence.until.duration, sequence.motions), and plan again"
        )
    if fit is not None:
        rest = ("LOADED.h5", "--only", "payload", "--fit", fit)
        return next_step(
            "play it with the load, record it, and identify", "identify", config, *rest
        )
    look = ("view", motions)
    if after is not None:
        both = ("OLD.h5", "NEW.h5", "-o", "DIAGNOSIS.h5")
        return (
            *next_step("look at it, play and record it (excite export)", *look),
            "then diagnose all recordings together:",
            Command(("excite", "diagnose", as_word(config), *both)),
        )
    played = Command(("excite", "simulate", as_word(config), as_word(motions), "-o", "measured.h5"))
    exported = Command(("excite", "export", as_word(motions), "--format", "csv"))
    return (
        *next_step("look at the motions; write them for the controller, or simulate it", *look),
        exported,
        played,
    )


def after_check(good: bool, config: Path, file: Path, planned: bool) -> tuple[Part, ...]:
    """Once motions of a file were examined, which is a result of ours if `planned`."""
    if not good:
        rest = ("--start", file, "-o", "MOTIONS.h5")
        return next_step("plan motions that keep the limits, from these", "optimize", config, *rest)
    if planned:
        return next_step("write them for the controller", "export", file, "--format", "csv")
    return next_step(f"{_RECORD} check the recording", "inspect", config, "DATA.csv")


def after_export(found: "Exported", file: Path) -> tuple[Part, ...]:
    """Once motions or a model were written."""
    if found.motions:
        return next_step(f"{_RECORD} check the recording", "inspect", "CONFIG.yaml", "DATA.csv")
    if found.held_out is not None and found.held_out.worse:
        if found.format == "c":
            return next_step("find what the model lacks", "diagnose", "CONFIG.yaml", "DATA.h5")
        return next_step("write the whole model, with all effects", "export", file, "-f", "c")
    if found.format in ("urdf", "mjcf"):
        return next_step("see whether it moves as the robot does", "replay", file, "DATA.h5")
    return next_step(
        "see from time to time whether the model still holds", "score", file, "DATA.h5"
    )


def after_identify(
    lacking: bool, config: Path, data: list[Path], fit: Path | None
) -> tuple[Part, ...]:
    """Once the declared model is fitted, and kept in `fit`: it lacks something, or does not."""
    if lacking:
        return next_step("find what the model lacks", "diagnose", config, *data)
    if fit is None:
        return next_step("keep the fit", "identify", config, *data, "-o", "fit.h5")
    return next_step("see whether it holds for other data", "score", fit, "DATA.h5")


def after_score(found: "Score", data: list[Path], output: Path | None) -> tuple[Part, ...]:
    """Once a model was played on data."""
    if any(not run.reasons for run in found.alarms):
        return next_step("see whether set-up and robot are those of the model",
                         "inspect", "CONFIG.yaml", *data)  # fmt: skip
    if found.alarms:
        return next_step("diagnose these data with the model's config",
                         "diagnose", "CONFIG.yaml", *data)  # fmt: skip
    if output is None:
        words = "none is needed. To compare days later, keep the score"
        return next_step(words, "score", Path(found.model), *data, "-o", "SCORE.h5")
    return next_step("score later recordings, too, and see what changed", "compare", output)


def after_forecast(good: bool, model: Path, job: Path) -> tuple[Part, ...]:
    """Once the error to expect on a job is known."""
    if good:
        return next_step("play it, and score its recording", "score", model, "DATA.h5")
    plan = ("optimize", "CONFIG.yaml", "--set", f"task.plan={job}")
    return next_step("plan motions for the positions, speeds and loads of this job", *plan)


def after_campaign(found: "Campaign", folder: Path, typed: Sequence[str]) -> tuple[Part, ...]:
    """Once a campaign, begun with what was `typed`, converged, spent its budget or is stuck."""
    last = folder / f"round_{len(found.rounds)}_diagnosis.h5"
    if found.ended == "complete":
        return next_step("use the model, for example in a controller", "export", last, "-f", "c")
    if found.ended == "budget":
        rounds, option = len(found.rounds), "--max-seconds"
        more = f"{2.0 * found.seconds:.0f}"
        if rounds >= found.asked.most_rounds:
            option, more = "--max-rounds", f"{2 * rounds}"
        again = list(typed)
        while option in again[:-1]:
            del again[again.index(option) : again.index(option) + 2]
        again += [*(["--resume"] * ("--resume" not in typed)), option, more]
        return next_step("go on with a larger budget", *again)
    return next_step("read what could not be separated", "report", last)
