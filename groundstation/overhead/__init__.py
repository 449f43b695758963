"""Mock-ups found by their coloured circles in pictures of the camera over the table; pure mathematics.

====================  ==============================================================================
``overhead_camera``   the camera: lens, place and attitude
``liveries``          which circles each mock-up wears
``circles, arcs``     picture -> circles with covariance
``tracker``           circles -> a pose per mock-up, or why there is none
====================  ==============================================================================

It stands on ``star_tracking`` for the model of a lens.
"""
