"""From the demand for pulses to the frame on the valve bus, and what the valve node reports."""
