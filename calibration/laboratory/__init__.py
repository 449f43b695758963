"""What an emulated laboratory guesses, estimated from an ordinary flight of a real one.

The physics is written down here from what valves and sensors are; nothing of the emulator is imported, so
that it and its judge cannot share a mistake.
"""
