"""Checks of a knowledge base that need no reasoner; `kb check` adds those that do."""
