"""Motions for controllers, identified models for simulators."""
