"""Managers of others as decision tables, made from what is published of them."""
