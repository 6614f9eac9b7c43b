"""Where a result comes from: config, seed, robot, versions, earlier data, times."""

from excite_cli.excitation.result import Result
from excite_cli.report.campaign import RebuiltResult, counted, in_figures
from excite_cli.report.page import Block, Fold, PageSection, TableBlock, Text


def config_section(campaign: RebuiltResult) -> PageSection:
    """What one needs to make the result again, and what was watched."""
    result, problem = campaign.result, campaign.problem
    blocks: list[Block] = [
        TableBlock(("what", "value"), _rows(campaign), title="This result"),
        Fold("The config, with all defaults (YAML)", (Text(result.config, "code"),)),
        _versions(result),
    ]
    if result.checked_pairs:
        blocks.append(_pairs(result))
    left_out = problem.extension.left_out
    if left_out:
        blocks.append(Text("Effects that the regressor leaves out: " + "; ".join(left_out) + "."))
    return PageSection(
        campaign.anchor("config"),
        campaign.titled("How it was made"),
        tuple(blocks),
        f"Minimised: {problem.spec.criterion.kind.replace('_', ' ')} of {problem.columns} columns, "
        f"{problem.variables} coefficients per motion, {len(problem.constraints)} kinds of "
        "constraints. The same config, seed and versions give the same numbers.",
    )


def _rows(campaign: RebuiltResult) -> tuple[tuple[str, ...], ...]:
    result, problem = campaign.result, campaign.problem
    robot, trajectory = problem.robot, problem.trajectory
    earlier = ", ".join(result.priors) or "none"
    seconds = sum(motion.seconds for motion in result.motions)
    evaluations = sum(motion.evaluations for motion in result.motions)
    base = "floating base that stands still" if robot.floating else "fixed base"
    return (
        ("file", campaign.name),
        ("robot", f"{robot.name}, {robot.n} moved joints, {base}"),
        ("URDF", problem.spec.robot.urdf),
        ("robot hash", result.fingerprint),
        ("measured rows", str(len(robot.rows))),
        ("base parameters", str(problem.base.rank)),
        ("columns of effects", ", ".join(result.effect_names) or "none"),
        ("trajectory", f"{problem.spec.trajectory.family}, {in_figures(trajectory.duration)} s"),
        ("seed", str(result.seed)),
        ("earlier data", earlier),
        ("computation time", f"{seconds:.1f} s, {counted(evaluations, 'evaluation')}"),
    )


def _versions(result: Result) -> TableBlock:
    rows = tuple(sorted(result.versions.items()))
    return TableBlock(("library", "version"), rows, title="Versions", folded=True)


def _pairs(result: Result) -> Block:
    """Pairs that are kept apart, and those that are not, with the reasons."""
    blocks: list[Block] = [
        TableBlock(("checked",), tuple((pair,) for pair in result.checked_pairs)),
    ]
    if result.dropped_pairs:
        dropped = tuple((pair,) for pair in result.dropped_pairs)
        blocks.append(TableBlock(("not checked, and why",), dropped))
    return Fold(
        f"{counted(len(result.checked_pairs), 'pair')} checked, "
        f"{len(result.dropped_pairs)} not checked",
        tuple(blocks),
    )
