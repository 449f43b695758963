"""Files that people hand over, read in one way: bytes, text, tables, JSON, TOML; refused in one sentence."""
