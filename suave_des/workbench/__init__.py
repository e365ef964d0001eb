"""The knowledge workbench: checks and edits rules, and tells what they do."""
