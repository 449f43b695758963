"""What the star camera sees, from the frame to the fix."""
