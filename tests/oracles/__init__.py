"""What the compiled core must agree with: the same mathematics in NumPy and plain Python, step by step.

No product code. Whoever changes a formula changes it in ``groundstation/core`` and here; tests tell if not.
"""
