"""Programs outside the station that command a vehicle: their texts in, wrenches and requests of ours out."""
