"""The sky that is not there: LEDs under a ceiling, and the pictures a webcam that looks up takes of them."""
