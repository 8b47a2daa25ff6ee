"""PNG files, written without any image library."""

import struct
import zlib


def write(path, levels):
    """`levels`: uint8, (rows, columns) or (rows, columns, 3)."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rows, columns = levels.shape[:2]
    head = struct.pack(">IIBBBBB", columns, rows, 8, 2 if levels.ndim == 3 else 0, 0, 0, 0)
    lines = b"".join(b"\0" + line.tobytes() for line in levels)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(lines, 1)) +
                     chunk(b"IEND", b""))
