"""Where missions run: in this process, in worker processes on this machine, or on the workers of a Dask cluster."""
