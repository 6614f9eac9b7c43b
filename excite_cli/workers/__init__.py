"""Where work is done: this process, processes of this machine, a dask cluster."""
