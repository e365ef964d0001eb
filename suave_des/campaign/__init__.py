"""Campaigns: many missions, their seeds, executors and result files."""
