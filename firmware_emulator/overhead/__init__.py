"""What the camera over the table sees; shares nothing with whoever looks for mock-ups in its pictures."""
