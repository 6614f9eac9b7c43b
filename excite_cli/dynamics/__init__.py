"""Regressor, base parameters, inverse dynamics and their derivatives; uncertain inertias."""
