"""Checks what can be checked of libraries for macOS without macOS: check_macos.py FILE...

Each library in these wheels, zips, archives or dylibs: built for the processor that the file's name says, for macOS 11
or older; links nothing but the system's own libraries and frameworks; if it is linked by name, it has one that leaves
the folder to the program; its signature, without which arm64 runs nothing, covers it whole and holds, page by page.
Prints `ok: ...` or `FAILED: ...`.
"""

import argparse
import hashlib
import struct
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

import lief

OLDEST = [11, 0]
SYSTEM = ("/usr/lib/", "/System/Library/Frameworks/")
PROCESSORS = {"arm64": "ARM64", "x86_64": "X86_64", "x64": "X86_64"}
# Apple, TN3126: magic numbers and offsets of a signature's parts, all big-endian.
SUPER_BLOB, CODE_DIRECTORY, SHA256 = 0xFADE0CC0, 0xFADE0C02, 2


def libraries(file):
    """The libraries for macOS in a file, by name."""
    if zipfile.is_zipfile(file):
        with zipfile.ZipFile(file) as archive:
            for name in archive.namelist():
                if name.endswith(".whl"):
                    with tempfile.NamedTemporaryFile(suffix=".whl") as inner:
                        inner.write(archive.read(name))
                        inner.flush()
                        yield from libraries(Path(inner.name))
                elif name.endswith((".so", ".dylib")):
                    yield name, archive.read(name)
    elif tarfile.is_tarfile(file):
        with tarfile.open(file) as archive:
            for entry in archive:
                if entry.isfile() and entry.name.endswith((".so", ".dylib")):
                    yield entry.name, archive.extractfile(entry).read()
    else:
        yield file.name, file.read_bytes()


def facts(data, processor):
    """The facts that should hold of a library, and whether each does."""
    # It complains of what strip left empty.
    lief.logging.disable()
    parsed = lief.MachO.parse(list(data))
    if parsed is None:
        yield "is a library for macOS", False
        return
    found = parsed.at(0)
    yield f"is for {processor}", found.header.cpu_type.name == processor
    oldest = list(found.build_version.minos if found.has_build_version else found.version_min.version)
    yield f"runs from macOS {'.'.join(map(str, oldest))}", oldest[:2] <= OLDEST
    own = [one.name for one in found.libraries if one.command == lief.MachO.LoadCommand.TYPE.ID_DYLIB]
    linked = [one.name for one in found.libraries if one.command != lief.MachO.LoadCommand.TYPE.ID_DYLIB]
    foreign = [name for name in linked if not name.startswith(SYSTEM)]
    yield f"links the system's libraries alone {foreign or ''}", not foreign and linked
    yield f"is found where the program says: {own}", all(name.startswith("@rpath/") for name in own)
    # Macs with Intel's processors ask for none, and linkers leave it out for them.
    if found.has_code_signature or processor == "ARM64":
        yield "has a signature that holds", found.has_code_signature and signature_holds(data, found.code_signature)


def signature_holds(data, signature):
    """Whether each page has the hash that the code directory gives, and all up to the signature is covered."""
    blob = data[signature.data_offset :][: signature.data_size]
    if len(blob) < signature.data_size:
        return False
    magic, _, count = struct.unpack_from(">3I", blob)
    if magic != SUPER_BLOB:
        return False
    for part in range(count):
        _, start = struct.unpack_from(">2I", blob, 12 + 8 * part)
        if struct.unpack_from(">I", blob, start)[0] != CODE_DIRECTORY:
            continue
        hashes, slots, limit = (struct.unpack_from(">I", blob, start + at)[0] for at in (16, 28, 32))
        kind, page = blob[start + 37], 1 << blob[start + 39]
        pages = [data[at : min(at + page, limit)] for at in range(0, limit, page)]
        stored = [blob[start + hashes + 32 * k :][:32] for k in range(slots)]
        is_whole = kind == SHA256 and limit == signature.data_offset and len(pages) == slots
        return is_whole and stored == [hashlib.sha256(one).digest() for one in pages]
    return False


def main():
    """Checks all files; status 1 if something does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", metavar="FILE", type=Path)
    failed = 0
    for file in parser.parse_args().files:
        if not file.is_file():
            parser.error(f"{file} is not a file")
        processor = next((value for name, value in PROCESSORS.items() if name in file.name.split("macos")[-1]), None)
        inside = list(libraries(file))
        checks = [(f"{file.name} has a library for a processor", bool(inside) and processor is not None)]
        for name, data in inside:
            checks += [(f"{file.name}: {Path(name).name} {what}", holds) for what, holds in facts(data, processor)]
        for what, holds in checks:
            print(f"{'ok' if holds else 'FAILED'}: {what}")
            failed += not holds
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
