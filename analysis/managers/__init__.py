"""Programs that make decision tables of managers that were published."""
