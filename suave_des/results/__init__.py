"""Reports: statistics, tables and figures, from result files only."""
