"""The compiled core: what has to be fast, in plain C, with an equal answer in NumPy beside it.

One C file holds one concept; all of them make one small library without dependencies, which ``library``
loads by ctypes and ``build`` compiles at installation. Without it (no compiler, stale) the callers use
their NumPy code. The callers live with their mathematics and own the buffers; nothing in C allocates.
"""
