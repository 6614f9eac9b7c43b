"""The robot of a URDF: joints, links, limits, payload."""
