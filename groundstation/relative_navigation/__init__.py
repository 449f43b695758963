"""Relative navigation by camera: where another craft is and how it turns, from pictures of known points.

Pure mathematics: arrays and small frozen dataclasses; no bus, no clock, no I/O, no messages.

=====================  ==================================================================================
``pinhole``            how a camera sees; the published form of it converted
``target``             the points of the other craft, its inertia, the turns that map it on itself
``intensity``          normalisation, thresholds, glare
``outlines``           blobs of a picture: outlines, areas
``centres``            THE TABLE of ways from a blob to its centre with covariance
``antennas``           the published rule: far ends of the longest outline
``colours``            markers by hue, or by a test trained from clicks
``spots``              picture -> centres
``matching``           centres to points: one to one, near a prediction
``subset_search``      centres to points from nothing
``planar_twin``        the second pose that coplanar points allow
``solvers``            THE TABLE of pose solvers: ``levenberg`` (default), ``newton``, ``evolved_pose``
``bounds``             Cramer-Rao bounds
``hill``               motion of the centres of mass, closed form
``attitude_motion``    Euler's equations with gravity gradient
``precession``         the regular precession of an axisymmetric body
``motion``             both together between frames, with process noise
``motion_filter``      poses and motion put together; learns how much of the motion is unmodelled
``aliasing``           whether the target turns too fast for the frames
``published_frames``   frames followed as published
``tracker``            frames -> ``Track``, one answer per frame
``stage_spin``         rates of a stage in regular precession from a few frames
``stage_evolution``    the same by the published search
``error_table``        the published table's statistics beside honest ones
``two_line_elements``  relative motion from the NORAD catalogue by SGP4
=====================  ==================================================================================

Frames: ``camera`` (x right, y down, z forward, origin in the optical centre), ``body`` (of the target),
``orbital`` (x radial up, y along-track, z along the orbit's normal, origin in the centre of mass of the craft
that carries the camera). A pose is ``X_camera = camera_from_body @ X_body + position_camera_m``; quaternions
scalar first. Errors of a pose are six numbers: position in camera axes (m), then the small turn about camera
axes that comes in front: ``exp(turn) @ camera_from_body`` (rad). Rotations are plain (3, 3) matrices here:
a frame has to be solved in a tenth of a millisecond. Pixels: (0, 0) is the centre of the top-left one.
"""
