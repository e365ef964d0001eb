"""The policy, the decision in every state: as cases, as tables and as a picture."""
