"""Two craft in orbit: their motion by numerical integration, and pictures of the one by the other.

Nothing here knows the ground station's mathematics: no closed form of the relative motion, no series of the
turn, no derivative of a projection.
"""
