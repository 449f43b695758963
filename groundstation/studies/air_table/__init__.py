"""The published experiments on the air table: star camera and inertial block."""
