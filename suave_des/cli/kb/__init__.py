"""suave-des kb: look at the knowledge base, edit its rules, and ask what they do."""
