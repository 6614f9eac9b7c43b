"""`excite selftest`: whether a robot's motions would give away what its model lacks."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.completion import complete_effect
from excite_cli.cli.console import Terminal
from excite_cli.cli.stopping import answer_so_far

_of_robot = partial(typer.Option, rich_help_panel="Simulated robot")
_recorded = partial(typer.Option, rich_help_panel="Recording")
_ASKED = "The case that runs is finished first; Ctrl-C again to stop at once."


@options.command
def selftest(
    terminal: Terminal,
    config: options.Config,
    motions: Path = typer.Argument(
        ...,
        help="Planned motions (a result file, {motion_formats}), or measured data of the robot, "
        "whose motions are replayed.",
        show_default=False,
    ),
    effect: list[str] | None = _of_robot(
        None,
        "--effect",
        metavar="KIND@JOINT=VALUE",
        help="Try this effect (may be repeated), as for `excite simulate`. Default: those that "
        "many robots have, on every joint, at 3 to 10% of its torque.",
        autocompletion=complete_effect,
    ),
    cases: int | None = typer.Option(
        None, "--cases", min=1, metavar="N", help="At most so many, spread over kinds and joints."
    ),
    inertia_error: float = _of_robot(
        0.2, "--inertia-error", help="Deviation of the robot's inertias from the URDF; 0: none."
    ),
    rate: float | None = _recorded(
        None, "--rate", help="Samples per second [Hz]. Default: the data's, else 500."
    ),
    torque_noise: float = _recorded(
        0.01, "--torque-noise", help="Torque noise as a share of the joint's RMS torque."
    ),
    noise_correlation: float = _recorded(
        0.0, "--noise-correlation", help="Correlation of the noise from sample to sample."
    ),
    encoder: float = _recorded(2e-05, "--encoder", help="Resolution of the encoders, in rad (m)."),
    seed: options.Seed = None,
    output: Path | None = options.written(
        "--output", "-o", metavar="FOLDER", help="Keep a record of every case in this folder."
    ),
    resume: bool = typer.Option(
        False, "--resume", help="Skip the finished cases in the folder of -o."
    ),
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
) -> None:
    """Try whether motions would give away what the model lacks, effect by effect.

    Each effect is put into a simulated robot of its own, which plays all motions; a diagnosis of
    the recordings, the last one held out, is then judged. found: it names the effect and joint.
    confounded: it names another effect there, or lists the planted one as an alias or as taken up
    by inertias. not found: it confirms nothing. wrong: it confirms an effect elsewhere. Ctrl-C ends
    with the cases done so far. Exit status 1: a case is wrong, or failed.

    Examples:
      excite selftest ur10.yaml ur10.h5 --cases 4
      excite selftest ur10.yaml ur10.h5 --torque-noise 0.05 \\
          --effect load_dependent_friction@elbow_joint=0.06
      excite selftest ur10.yaml measured.h5 --cases 2 -o tested
    """
    from excite_cli.api.loading import load_case
    from excite_cli.api.selftesting import (
        StudyNews,
        read_motions,
        selftest_answer,
        usual_settings,
    )
    from excite_cli.api.selftesting import selftest as test_motions
    from excite_cli.api.working import working

    with (
        working(workers, scheduler, threads, terminal.tell) as place,
        terminal.live("") as line,
        answer_so_far(lambda: terminal.say(_ASKED)) as ended,
    ):
        case = load_case(config, overrides or ())
        played = read_motions(case, motions, terminal.tell)
        given = usual_settings(case, played)
        settings = replace(
            given,
            seed=given.seed if seed is None else seed,
            rate=given.rate if rate is None else rate,
            torque_noise=torque_noise,
            noise_correlation=noise_correlation,
            encoder=encoder,
            inertia_error=inertia_error,
        )

        def progress(news: StudyNews) -> None:
            line(f"{news.done} of {news.total} cases done; {news.told}", news.done, news.total)

        found = test_motions(
            case,
            played,
            effect or (),
            settings,
            cases=cases,
            output=output,
            resume=resume,
            overwrite=overwrite,
            workers=place,
            progress=progress,
            tell=terminal.tell,
            ended=ended,
        )
    terminal.show(selftest_answer(found, None if output is None else str(output)))
