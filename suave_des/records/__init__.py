"""Files of results: what stands in them, and how each is written and read."""
