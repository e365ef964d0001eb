"""Campaigns: many missions, their executors and result files. Most users need only
`run_campaign`.
"""
