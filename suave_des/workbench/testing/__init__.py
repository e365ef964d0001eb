"""Tests of rules: read, run and reported like those of programs, with coverage and mutation."""
