"""Truth: vehicles on an air table, with a time step of its own. Nothing here knows of wires or estimates."""
