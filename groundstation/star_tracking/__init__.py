"""Star tracking: pictures of a ceiling of LEDs in, table poses with true covariance out.

Pure mathematics: arrays and small frozen dataclasses; no bus, no clock, no I/O, no messages.

==================  ====================================================================================
``camera_model``    lens and mount of a star camera
``star_catalogue``  where the stars are
``stamp_delay``     from the exposure to the arrival, as calibrated
``projection``      where stars fall in a picture
``picture_repeats`` pictures delivered twice: frozen, in a loop, torn
``picture_seams``   pictures put together from parts that no lens saw side by side
``detection``       picture -> spots with sub-pixel centres and their covariance
``rays``            pixel -> point of the ceiling plane relative to the body (full camera model)
``sky_index``       catalogue -> tables for constant-time look-ups of stars, triangles and pairs
``tracker``         spots -> ``StarFix`` or ``NoFix``, lost in space or from a prior
``published``       the published Delaunay identification, for comparison
``published_image`` the published steps from a picture to star centres, for comparison
``identifications`` THE TABLE of ways from a picture to a fix that a rig or a command names
==================  ====================================================================================

Frames: pixel (u right, v down, (0, 0) the centre of the top-left pixel), ``body``, ``table``; ceiling
coordinates are table x, y carried straight up. A pose is the body origin (x, y) in the table and the
heading, counter-clockwise from table +x to body +x, at the middle of the exposure.
"""
