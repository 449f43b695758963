"""What ``make bench`` measures: one file per subject, each a function from a ``Bench`` to rows."""
