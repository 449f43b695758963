"""Mock-ups found by coloured circles in pictures of the camera over the table; pure mathematics."""
