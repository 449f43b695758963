"""What people want to know of a run: monitor, latency ledger, report, figures."""
