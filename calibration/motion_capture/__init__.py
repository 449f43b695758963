"""How a motion-capture system lies to the table, found against poses of another source."""
