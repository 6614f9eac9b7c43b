"""Peers on one problem, side by side: FIGAROH, finite differences, and this program."""
