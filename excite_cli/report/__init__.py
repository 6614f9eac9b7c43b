"""Stored results as pages and figures."""
