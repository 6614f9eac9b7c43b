"""Errors and noise floors of a file: of the joints that the file names."""

from collections.abc import Mapping, Sequence

from excite_cli.identification.errors_of_torque import Errors


def require_joints(
    joints: Sequence[str], errors: Sequence[Errors], noise_floor: Mapping[str, float] | None
) -> None:
    """Raise ValueError where they are of other joints."""
    found: list[Mapping[str, float]] = [
        mapping
        for each in errors
        for mapping in (each.relative, each.relative_moving, each.rms, each.rms_raw)
    ]
    found += [each.samples for each in errors if each.samples]
    others = set(noise_floor or ()) - set(joints)
    if others or any(set(mapping) != set(joints) for mapping in found):
        raise ValueError("its errors are those of other joints")
