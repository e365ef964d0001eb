"""Campaigns: many missions, their executors and result files. `run_campaign` is all that most users need."""
