"""The table: what pulls a gliding vehicle along it, learned from flights, and how to level it."""
