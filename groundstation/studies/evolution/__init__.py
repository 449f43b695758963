"""The study of video navigation with differential evolution: a stage, and two CubeSats."""
