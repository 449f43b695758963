"""The compiled core: what has to be fast, in plain C.

One C file holds one concept; ``api.h`` declares what Python sees of them, once for both languages. They make
one small library without dependencies; ``build`` compiles it at installation, ``library`` loads it by cffi.
The callers live with their mathematics and own the buffers; nothing in C allocates. An equal of every piece
in NumPy stands in ``tests/oracles``.
"""
