"""The policy: what is decided in every state; as cases, as tables and as a picture."""
