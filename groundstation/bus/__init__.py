"""Topics, envelopes and transports."""
