"""Motion capture as a source of fixes and as a reference."""
