"""What is minimised: functions of the singular values of the regressor."""
