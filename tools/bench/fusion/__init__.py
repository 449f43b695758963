"""The fusion on data sets of ``tools/fusion_truth.py``, beside other methods on the same data."""
