"""The rig file: what stands in the laboratory and how it is wired; read once, checked before all moves."""
