"""What can be requested of a star tracker."""

from groundstation.declarations.request import Action

PICTURE = Action("picture", "star_tracker", "keep the next picture of the star camera, with its stars named")
