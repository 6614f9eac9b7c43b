"""Other tools beside this program: exciting motions (the races), and dynamics from logs."""
