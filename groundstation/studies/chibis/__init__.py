"""The study of the Chibis-M: video navigation of a microsatellite that leaves a cargo craft."""
