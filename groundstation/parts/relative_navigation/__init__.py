"""What a camera on the hull sees of another: distance, bearing, attitude, a leader to follow by it."""
