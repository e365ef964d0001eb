"""Long-running checks and measurements, each run as `python benchmarks/NAME.py`."""
