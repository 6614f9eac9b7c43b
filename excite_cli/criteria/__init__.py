"""What is made small: functions of the singular values of the regressor."""
