"""The search for the best motion: a feasible interior point."""
