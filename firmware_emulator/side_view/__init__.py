"""What a camera on a mock-up's hull sees of the other mock-ups."""
