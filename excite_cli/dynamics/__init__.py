"""The robot: model, regressor, base parameters, distances, uncertain inertias."""
