"""The exemplar's own configuration files: read as scenarios, and written from them."""
