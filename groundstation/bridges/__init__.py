"""What a run shows to other programs while it flies: Foxglove and Lichtblick, ROS 2. They only look on."""
