"""How fast missions are on this machine, beside what one would write otherwise."""
