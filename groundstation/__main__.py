"""``python -m groundstation`` is the ``groundstation`` command."""

from groundstation.cli.main import main

main()
