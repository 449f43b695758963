"""What the controller wants, and how far it is from its goal."""
