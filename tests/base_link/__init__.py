"""Tests of the base of a robot that stands."""
