"""XXH3-128 against the vectors of its authors."""

import pytest

from groundstation.bridges.xxh3 import LONGEST, SHORTEST, xxh3_128

# length, low, high: XSUM_XXH128_testdata of xxHash 0.8.3, cli/xsum_sanity_check.c, seed 0
VECTORS = [
    (222, 0xF1AEBD597CEC6B3A, 0x337E09641B948717),
    (403, 0xCDEB804D65C6DEA4, 0x1B6DE21E332DD73D),
    (512, 0x617E49599013CB6B, 0x18D2D110DCC9BCA1),
]


def filled(length):
    """The buffer that the vectors are of: high bytes of powers of PRIME64 times PRIME32."""
    generator, out = 2654435761, bytearray()
    for _ in range(length):
        out.append(generator >> 56)
        generator = generator * 11400714785074694797 % 2**64
    return bytes(out)


@pytest.mark.parametrize(("length", "low", "high"), VECTORS)
def test_published_vectors(length, low, high):
    assert xxh3_128(filled(length)) == high << 64 | low


def test_all_lengths_that_tokens_have_are_hashed_apart():
    data = filled(LONGEST)
    assert len({xxh3_128(data[:length]) for length in range(SHORTEST, LONGEST + 1)}) == LONGEST - SHORTEST + 1


@pytest.mark.parametrize("length", [0, SHORTEST - 1, LONGEST + 1])
def test_other_lengths_are_refused(length):
    with pytest.raises(ValueError, match="expected 129 to 1024"):
        xxh3_128(bytes(length))
