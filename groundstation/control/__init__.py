"""Control of a planar mock-up: from where it is and should be to how long each valve opens.

The chain: ``Controller.update`` (state and goal to wrench) -> ``PulseModulator.update`` (wrench to on-times,
with ``Allocator`` inside) -> ``CommandMux.select`` (who may command). Frames: ``table`` and ``body`` as in
`groundstation.frames`; SI and radians. Nothing here reads a clock: spans and stamps are arguments.
"""
