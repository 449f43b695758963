"""A scenario many times: drawn, flown by many workers, each run a row, never lost."""
