"""`excite replay`: recorded torques, or set points, played on an exported model."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step


@options.command
def replay(
    terminal: Terminal,
    model: options.StoredModel,
    data: options.Data,
    held_out: options.OwnHeldOut = False,
    beside: Path | None = typer.Option(
        None,
        "--beside",
        metavar="MODEL",
        help="Where set points are played: another model of the robot, on the same log.",
    ),
) -> None:
    """Play recorded torques on the model as exported to simulators: does it move as the robot did?

    The model is exported to MJCF and driven by the measured torques in MuJoCo, beside the URDF as
    it is. Both are stabilised by the same low-gain position loop (10 rad/s), since no model tracks
    on torques alone for long; the table shows how far each deviates from the measured motion.

    Where drives follow set points (measurement.torque: command) the recorded set points are
    played instead, on position actuators and with no loop that holds the model. The table has the
    deviation 0.1, 1 and 10 s after starts from the measured state, and over the whole log. The URDF
    gets the same gains, limits and delay.

    Exit status 1: the model deviates no less than the URDF.

    Examples:
      excite replay diagnosis.h5 measured.h5 --held-out
    """
    from excite_cli.api.replaying import replay as replay_data
    from excite_cli.api.replaying import replay_answer

    found = replay_data(model, data, held_out=held_out, beside=beside, tell=terminal.tell)
    answer = replay_answer(found)
    following = (
        next_step("take the model to a simulator", "export", model, "-f", "mjcf")
        if answer.good
        else next_step("find what the model lacks", "diagnose", "CONFIG.yaml", *data)
    )
    terminal.show(answer, following)
