"""The command line: one thin module for each command. Heavy imports happen inside the commands."""
