"""Tests of suave-des; what several test modules share is in tests.helpers."""
