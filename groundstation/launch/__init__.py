"""The processes of a live run: started, supervised, ended in good order; one request; one lockstep run."""
