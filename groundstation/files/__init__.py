"""Files of every kind, read and written in one way: tables of numbers, TOML, JSON, pictures."""
