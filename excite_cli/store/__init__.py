"""Records to HDF5 files and back."""
