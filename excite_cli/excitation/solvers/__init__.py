"""Ways to the best motion: feasible interior point, SQP, SLSQP."""
