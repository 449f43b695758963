"""A ceiling from the overlapping pictures of a sweep.

================  =================================================================================
``sweep``         the procedure: pictures and anchors in, star list and outcome out
``verification``  how pictures fit a list that they had no part in
``surveyed_sky``  linked, anchored, adjusted
``sweep_parts``   pictures that hang together, and the part that the anchors are in
``anchors``       the file of stars measured by tape
``tape``          do the anchors agree with the pictures and with each other
``linking``       pictures strung together into one map, or into several if the sweep falls apart
``overlap``       two constellations laid on one another, or the knowledge that they do not overlap
``triangles``     triangles of neighbouring spots, comparable between pictures
================  =================================================================================

The lower four are plane geometry on complex numbers (x + iy, metres on the ceiling).
"""
