"""The `kb` commands: checks and edits rules, and shows what they do."""
