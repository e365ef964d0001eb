"""Managing subsystems: their interface, and none, random, metacontrol, bt."""
