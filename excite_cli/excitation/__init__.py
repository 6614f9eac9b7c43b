"""From a problem to motions: objective, start, solvers, certificate, entry."""
