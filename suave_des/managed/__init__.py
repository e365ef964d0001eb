"""Managed subsystem: functions, modes and the mode manager, the mission coordinator."""
