"""Vehicle: 6-DOF rigid body, thruster allocation and health, guided autopilot."""
