"""Executors of missions: this process, worker processes on this machine, or the workers of a Dask cluster."""
