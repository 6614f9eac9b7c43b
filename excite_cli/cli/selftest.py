"""`excite selftest`: whether a robot's motions would give away what its model lacks."""

from dataclasses import replace
from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.completion import complete_effect
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step
from excite_cli.cli.stopping import answer_so_far

_ASKED = "The case that runs is finished first; Ctrl-C again to stop at once."


@options.command
def selftest(
    terminal: Terminal,
    config: options.Config,
    motions: Path = typer.Argument(
        ...,
        help="A result file, a motion, or measured data, whose motions are replayed.",
        show_default=False,
    ),
    effect: list[str] | None = typer.Option(
        None,
        "--effect",
        metavar="KIND@JOINT=VALUE",
        help="Try this effect, as in `excite simulate` (may be repeated). Default: those that "
        "many robots have, on every joint, at 3 to 10% of its torque.",
        autocompletion=complete_effect,
    ),
    cases: int | None = typer.Option(
        None, "--cases", min=1, help="At most so many, spread over kinds and joints."
    ),
    output: Path | None = options.written(
        "--output",
        "-o",
        metavar="FOLDER",
        help="Keep every case here as soon as it is done, and a page of all, selftest.html.",
    ),
    resume: bool = typer.Option(
        False, "--resume", help="Skip cases that are in the folder; repeat failed ones."
    ),
    overwrite: options.Overwrite = False,
    inertia_error: options.InertiaError = 0.2,
    rate: float | None = typer.Option(
        None, "--rate", help="Samples per second [Hz]. Default: the data's, else 500."
    ),
    torque_noise: options.TorqueNoise = 0.01,
    noise_correlation: options.NoiseCorrelation = 0.0,
    encoder: options.Encoder = 2e-05,
    seed: options.Seed = None,
    overrides: options.Set = None,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
) -> None:
    """Try whether motions would give away what the model lacks, effect by effect.

    Each effect is put into a simulated robot of its own, which plays all motions; a diagnosis of
    the recordings, the last one held out, is then judged. found: it names the effect and joint.
    confounded: it names another effect there, or lists the planted one as an alias or as taken up
    by inertias. not found: it confirms nothing. wrong: it confirms an effect elsewhere. Beside it
    stands the outcome that was predicted. Ctrl-C ends with the cases done so far. Exit status 1: a
    case is wrong, or failed.

    Examples:
      excite selftest ur10.yaml ur10.h5 --cases 2 -o tested
      excite selftest ur10.yaml ur10.h5 --torque-noise 0.05 \\
          --effect load_dependent_friction@elbow_joint=0.06
    """
    from excite_cli.api.loading import load_case
    from excite_cli.api.selftesting import PAGE, selftest_answer, usual_settings
    from excite_cli.api.selftesting import selftest as test_motions
    from excite_cli.api.working import working

    case = load_case(config, overrides or ())
    usual = usual_settings(case, motions)
    settings = replace(
        usual,
        seed=usual.seed if seed is None else seed,
        rate=usual.rate if rate is None else rate,
        torque_noise=torque_noise,
        noise_correlation=noise_correlation,
        encoder=encoder,
        inertia_error=inertia_error,
    )
    with (
        working(workers, scheduler, threads, terminal.tell) as place,
        terminal.live("") as line,
        answer_so_far(lambda: terminal.say(_ASKED)) as ended,
    ):
        found = test_motions(
            case,
            motions,
            effect or (),
            settings,
            cases=cases,
            output=output,
            resume=resume,
            overwrite=overwrite,
            workers=place,
            progress=lambda it: line(f"{it.done} of {it.total}; {it.told}", it.done, it.total),
            tell=terminal.tell,
            ended=ended,
        )
    folder = "" if output is None else str(output / PAGE)
    answer = selftest_answer(found, terminal.verbose, folder)
    following = (
        next_step("play motions like these on the robot", "export", motions, "-f", "csv")
        if answer.good
        else next_step("plan more motions, and test again", "optimize", config, "--motions", "6")
    )
    terminal.show(answer, following)
