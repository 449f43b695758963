"""A ceiling from overlapping pictures: which pictures belong together, and whether the anchors fit.

=============  ====================================================================================
``triangles``  triangles of neighbouring spots, comparable between pictures
``overlap``    two constellations laid on one another, or the knowledge that they do not overlap
``linking``    pictures of a sweep strung together into one map, or into several if it falls apart
``tape``       do the tape-measured anchors agree with the pictures and with each other
=============  ====================================================================================

Everything here is plane geometry on complex numbers (x + iy, metres on the ceiling).
"""
