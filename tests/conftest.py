"""What holds for all tests: hypothesis draws the same examples everywhere and measures no time."""

from hypothesis import settings

settings.register_profile("everywhere", deadline=None, derandomize=True)
settings.load_profile("everywhere")
