"""Studies: published experiments run again, figure by figure, beside what we do better."""
