"""``python -m groundstation`` is the ``groundstation`` command."""

INTERRUPTED = 130
"""What a shell expects of a command that Ctrl-C ended."""


def main() -> None:
    """Entry point: Ctrl-C is no traceback, not even while the command is loaded."""
    try:
        from groundstation.cli.main import main as command
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
    command()


if __name__ == "__main__":
    main()
