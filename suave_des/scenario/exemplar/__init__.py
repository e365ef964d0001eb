"""The exemplar's own configuration files, and their import as a scenario and a campaign of ours."""
