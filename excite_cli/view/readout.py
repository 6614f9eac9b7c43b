"""What stands beside the moving robot in the browser: margins and joint positions, as HTML."""

from html import escape

import numpy as np

from excite_cli.excitation.problem import Problem
from excite_cli.robot.model import Robot
from excite_cli.view.instants import Instants

_BLUE, _VERMILION, _TRACK = "#0072B2", "#D55E00", "#8884"
_NEAR = 0.05  # share of its scale, or of a range, below which a margin is reported in colour
_TABLE = '<table style="width:100%;font-size:12px;border-collapse:collapse;line-height:1.35">'


def margins_html(instants: Instants, instant: int) -> str:
    """Every constraint with the smallest margin at this instant, and where it is."""
    rows = []
    for track in instants.margins:
        value, share = float(track.values[instant]), float(track.shares[instant])
        colour = _VERMILION if share < _NEAR else "inherit"
        broken = " BROKEN" if value < 0 else ""
        rows.append(
            f"<tr><td>{escape(track.name)}</td>"
            f'<td style="text-align:right;white-space:nowrap;color:{colour}">'
            f"{value:.4g} {escape(track.units[instant])}{broken}</td></tr>"
            f'<tr><td colspan="2" style="opacity:.6;padding:0 0 5px 8px">'
            f"{escape(track.labels[instant])}</td></tr>"
        )
    if not rows:
        return _boxed("This problem has no constraints.")
    return _boxed(f"{_TABLE}{''.join(rows)}</table>")


def nearest_html(instants: Instants, instant: int) -> str:
    """The nearest pair in words."""
    if instants.nearest is None:
        return _boxed("This problem keeps no distances.")
    distance = 1000 * float(instants.nearest.distances[instant])
    label = escape(instants.nearest.labels[instant])
    return _boxed(f'nearest: {label}, <b style="color:{_VERMILION}">{distance:.1f} mm</b>')


def joints_html(problem: Problem, instants: Instants, instant: int) -> str:
    """Every joint with its position on a bar from its lower to its upper limit."""
    robot: Robot = problem.robot
    lower, upper = robot.limits.lower, robot.limits.upper
    rows = []
    for joint, name in enumerate(robot.joint_names):
        q, unit = float(instants.q[instant, joint]), "m" if robot.sliding[joint] else "rad"
        low, high = float(lower[joint]), float(upper[joint])
        bar = _bar((q - low) / (high - low)) if np.isfinite(high - low) else "no limits"
        ends = f"{low:.2f} … {high:.2f}" if np.isfinite(high - low) else ""
        rows.append(
            f'<tr><td title="{ends}">{escape(name)}</td>'
            f'<td style="text-align:right;white-space:nowrap">{q:+.3f} {unit}</td></tr>'
            f'<tr><td colspan="2" style="padding:0 0 4px">{bar}</td></tr>'
        )
    return _boxed(f"{_TABLE}{''.join(rows)}</table>")


def _bar(share: float) -> str:
    near = min(share, 1 - share) < _NEAR
    place = 100 * float(np.clip(share, 0.0, 1.0))
    return (
        f'<div style="position:relative;height:5px;border-radius:3px;background:{_TRACK}">'
        f'<div style="position:absolute;left:calc({place:.1f}% - 4px);top:-2px;width:9px;'
        f'height:9px;border-radius:50%;background:{_VERMILION if near else _BLUE}"></div></div>'
    )


def _boxed(content: str) -> str:
    return f'<div style="padding:2px 14px 6px;font-size:12px">{content}</div>'
