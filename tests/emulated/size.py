"""Flash and static RAM of images, from their ELF files."""

import struct
import sys

RAM = 0x20000000

for path in sys.argv[1:]:
    data = open(path, "rb").read()
    headers, size, count = (struct.unpack_from(kind, data, at)[0] for kind, at in (("<I", 28), ("<H", 42), ("<H", 44)))
    flash = ram = 0
    for k in range(count):
        kind, _, virtual, _, in_file, in_memory = struct.unpack_from("<6I", data, headers + k * size)
        if kind == 1:
            flash += in_file
            ram += in_memory if RAM <= virtual < RAM + (1 << 20) else 0
    print(f"{path.rsplit('/', 1)[-1]}: {flash} bytes of flash, {ram} bytes of static RAM")
