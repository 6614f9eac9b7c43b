"""Formats that robots are described in, and how each becomes a URDF."""
