"""Motion capture: poses of rigid bodies by way of the library `motioncapture` (extra `mocap`)."""
