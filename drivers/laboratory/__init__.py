"""What an emulated laboratory offers a runner."""

from drivers.laboratory.channels import *  # noqa: F403 - split up in the next commit
