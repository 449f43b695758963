"""A laser range finder for mock-ups, its emulated twin, and a controller, outside the ground station."""
