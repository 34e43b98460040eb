"""Writes fields bit by bit, as the CTF specification says; knows nothing of any reader."""

from __future__ import annotations


class BitWriter:
    """Bits of a packet.

    Attributes:
        position: of the next field, in bits.
    """

    def __init__(self) -> None:
        self.position = 0
        self._content = bytearray()

    def align(self, bits: int) -> None:
        self.position = -(-self.position // bits) * bits
        self._grow()

    def integer(self, value: int, size: int, align: int, big_endian: bool) -> None:
        """In little endian the lowest bit comes first, in big endian the highest."""
        self.align(align)
        begin = self.position
        self.position += size
        self._grow()
        for n in range(size):
            bit = begin + n
            if big_endian:
                self._content[bit // 8] |= (value >> (size - 1 - n) & 1) << (7 - bit % 8)
            else:
                self._content[bit // 8] |= (value >> n & 1) << (bit % 8)

    def bytes(self, content: bytes) -> None:
        self.align(8)
        for byte in content:
            self.integer(byte, 8, 8, False)

    def content(self) -> bytearray:
        return self._content

    def _grow(self) -> None:
        self._content.extend(bytes(-(-self.position // 8) - len(self._content)))
