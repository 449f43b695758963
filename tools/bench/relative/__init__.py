"""Relative navigation on scenes that share nothing with it, beside other solvers."""
