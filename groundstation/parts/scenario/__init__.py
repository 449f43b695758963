"""The timeline of a scenario as a part: what it asks of vehicles is published like anybody's request."""
