"""XXH3-128 of texts of 129 to 1024 bytes, as ROS 2 tokens are: a hash for names, not for secrets.

Source: xxHash specification 0.2.0, sections on medium and large inputs, with its default secret and seed 0;
names of constants are those of the specification. Written here since a few tokens a run need it, and no
library among the installed ones has it.
"""

import struct

SHORTEST, LONGEST = 129, 1024
_MEDIUM = 240
_WORD = (1 << 64) - 1
_PRIME32_1, _PRIME32_2, _PRIME32_3 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
_PRIME64_1, _PRIME64_2, _PRIME64_3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
_PRIME64_4, _PRIME64_5, _PRIME_MX1 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5, 0x165667919E3779F9
_SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f"
    "cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364"
    "eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e"
    "2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
_STRIPE = 64


def xxh3_128(data: bytes) -> int:
    """The hash; its low half in the low 64 bits.

    Raises:
        ValueError: The data are shorter or longer than any token.
    """
    if not SHORTEST <= len(data) <= LONGEST:
        raise ValueError(f"{len(data)} bytes, expected {SHORTEST} to {LONGEST}")
    low, high = _of_medium(data) if len(data) <= _MEDIUM else _of_large(data)
    return high << 64 | low


def _words(data: bytes, offset: int, count: int) -> tuple[int, ...]:
    return struct.unpack_from(f"<{count}Q", data, offset)


def _folded(a: int, b: int) -> int:
    """Both halves of a product of 128 bits, one over the other."""
    product = a * b
    return (product & _WORD) ^ (product >> 64)


def _avalanche(x: int) -> int:
    x ^= x >> 37
    x = x * _PRIME_MX1 & _WORD
    return x ^ x >> 32


def _of_medium(data: bytes) -> tuple[int, int]:
    acc = [len(data) * _PRIME64_1 & _WORD, 0]

    def mix(first: int, second: int, secret: int) -> None:
        one, two, keys = _words(data, first, 2), _words(data, second, 2), _words(_SECRET, secret, 4)
        acc[0] = acc[0] + _folded(one[0] ^ keys[0], one[1] ^ keys[1]) & _WORD
        acc[1] = acc[1] + _folded(two[0] ^ keys[2], two[1] ^ keys[3]) & _WORD
        acc[0] ^= two[0] + two[1] & _WORD
        acc[1] ^= one[0] + one[1] & _WORD

    for i in range(4):
        mix(32 * i, 32 * i + 16, 32 * i)
    acc[:] = map(_avalanche, acc)
    for i in range(4, len(data) // 32):
        mix(32 * i, 32 * i + 16, 32 * (i - 4) + 3)
    mix(len(data) - 16, len(data) - 32, 103)
    low = acc[0] + acc[1] & _WORD
    high = acc[0] * _PRIME64_1 + acc[1] * _PRIME64_4 + len(data) * _PRIME64_2 & _WORD
    return _avalanche(low), -_avalanche(high) & _WORD


def _of_large(data: bytes) -> tuple[int, int]:
    acc = [
        _PRIME32_3, _PRIME64_1, _PRIME64_2, _PRIME64_3, _PRIME64_4, _PRIME32_2, _PRIME64_5, _PRIME32_1,
    ]  # fmt: skip

    def accumulate(offset: int, secret: int) -> None:
        stripe, keys = _words(data, offset, 8), _words(_SECRET, secret, 8)
        for i in range(8):
            value = stripe[i] ^ keys[i]
            acc[i ^ 1] = acc[i ^ 1] + stripe[i] & _WORD
            acc[i] = acc[i] + (value & 0xFFFFFFFF) * (value >> 32) & _WORD

    for n in range((len(data) - 1) // _STRIPE):
        accumulate(_STRIPE * n, 8 * n)
    accumulate(len(data) - _STRIPE, len(_SECRET) - 71)

    def merged(start: int, secret: int) -> int:
        keys = _words(_SECRET, secret, 8)
        folds = (_folded(acc[i] ^ keys[i], acc[i + 1] ^ keys[i + 1]) for i in range(0, 8, 2))
        return _avalanche(start + sum(folds) & _WORD)

    low = merged(len(data) * _PRIME64_1 & _WORD, 11)
    return low, merged(~(len(data) * _PRIME64_2) & _WORD, len(_SECRET) - 75)
