"""What nodes say to each other: frozen payloads, one class per topic, and their CDR codec."""
