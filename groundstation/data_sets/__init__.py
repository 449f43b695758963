"""Data sets in folders: pictures of a ceiling, packets and fixes of a flight."""
