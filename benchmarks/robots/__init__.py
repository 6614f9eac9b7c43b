"""Robots that nobody prepared: where they come from, their way, and the page about them."""
