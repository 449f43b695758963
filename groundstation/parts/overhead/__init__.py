"""What the camera over the table sees, and how its fixes compare with those of the star tracker."""
