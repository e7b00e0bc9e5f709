"""An FMU's zip is one that every tool reads alike, with the files of an FMU of ours and no others."""

import struct
import tracemalloc
import warnings
from io import BytesIO
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZipFile, ZipInfo

import pytest

from dzdesign.codegen.fmu.archive import archive
from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.verify.fmu import fmu_archive
from dzdesign.verify.fmu.descriptions import file_faults, library_faults
from dzdesign.verify.fmu.fmu_archive import unpacked
from dzdesign.verify.fmu.fmu_file import read_fmu
from tests.support.host_fmus import with_files

GOOD = {"modelDescription.xml": b"<a/>", "sources/x.c": b"int x;" * 9}


def packed(*entries, comment=b"", kind=ZIP_DEFLATED):
    stream = BytesIO()
    with ZipFile(stream, "w", kind) as made, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, content in entries:
            made.writestr(name, content)
        made.comment = comment
    return stream.getvalue()


def linked(name):
    entry = ZipInfo(name)
    entry.external_attr, entry.create_system = 0o120777 << 16, 3
    return entry


def encrypted(content):
    """Set the flag of encryption in front of every entry and in the directory."""
    found = bytearray(content)
    for mark, place in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        at = found.find(mark)
        while at >= 0:
            found[at + place] |= 1
            at = found.find(mark, at + 1)
    return bytes(found)


def test_what_is_written_is_read():
    assert unpacked(archive(GOOD), "it") == GOOD


@pytest.mark.parametrize(
    "content",
    [
        packed(*GOOD.items(), ("modelDescription.xml", b"<b/>")),
        packed(*GOOD.items(), ("MODELDescription.xml", b"<b/>")),
        *(packed(*GOOD.items(), (name, b"x")) for name in
          ("../x", "/x", "a/../../x", "a\\x", "C:x", "a/./x", ".x", "a/", "a//x", "a/x ", "a\u00e9", "CON.", "x\n")),
        packed(*GOOD.items(), comment=b"comment"),
        packed(*GOOD.items(), kind=ZIP_BZIP2),
        packed(*GOOD.items(), (linked("link"), b"/etc/passwd")),
        encrypted(archive(GOOD)),
        b"#!/bin/sh\n" + archive(GOOD),
        archive({"modelDescription.xml": b"<b/>"}) + archive(GOOD),
        archive(GOOD) + b"\0",
        archive(GOOD).replace(b"sources/x.c", b"sources/y.c", 1),
        archive(GOOD)[:-30],
        b"",
    ],
)  # fmt: skip
def test_a_zip_that_tools_read_otherwise_is_refused(content):
    with pytest.raises(InputError, match=r"no FMU of dzdesign"):
        unpacked(content, "it")


def test_sizes_that_are_wrong_in_front_of_an_entry_are_refused():
    content = bytearray(archive(GOOD))
    struct.pack_into("<I", content, 22, 99)
    with pytest.raises(InputError, match="otherwise in front"):
        unpacked(bytes(content), "it")


def test_a_zip_that_grows_without_end_is_refused(monkeypatch):
    monkeypatch.setattr(fmu_archive, "LARGEST_OCTETS", 10**6)
    with pytest.raises(InputError, match="unpacks to more"):
        unpacked(archive({"modelDescription.xml": bytes(10**6 + 1)}), "it")
    with pytest.raises(InputError, match="101 files"):
        unpacked(archive({f"x{index}": b"" for index in range(101)}), "it")


def test_an_entry_that_unpacks_to_more_than_it_states_takes_no_memory():
    large = 2**26
    content = bytearray(archive({"modelDescription.xml": bytes(large)}))
    for at in (content.find(b"PK\3\4") + 22, content.find(b"PK\1\2") + 24):
        struct.pack_into("<I", content, at, 100)
    tracemalloc.start()
    try:
        with pytest.raises(InputError):
            unpacked(bytes(content), "it")
        assert tracemalloc.get_traced_memory()[1] < large // 8
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{", '{&quot;; system(&quot;x&quot;); &quot;'),
        ('encoding="UTF-8"', 'encoding="UTF-7"'),
        ("<fmiModelDescription", "<!DOCTYPE x [<!ENTITY a 'b'>]><fmiModelDescription"),
        ("<ModelVariables>", "<ModelVariables><?x?>"),
    ],
)
def test_a_description_that_tools_read_otherwise_is_refused(fmu, tmp_path, old, new):
    text = fmu.files["modelDescription.xml"].decode()
    assert old in text
    path = tmp_path / fmu.name
    path.write_bytes(archive({**fmu.files, "modelDescription.xml": text.replace(old, new, 1).encode()}))
    with pytest.raises(InputError):
        read_fmu(path)


@pytest.mark.parametrize(
    "path",
    ("binaries/linux32/{0}.so", "binaries/linux64/other.so", "resources/x.so", "sources/other.c", "other.xml",
     "binaries/x86_64-linux/other.so", "terminalsAndIcons/x.xml", "extra/dzdesign/other.json"),
)  # fmt: skip
def test_a_file_that_is_none_of_ours_is_found_though_the_manifest_names_it(fmu, compensator, path):
    name = path.format(fmu.identifier)
    manifest = {**fmu.manifest, "files": {**fmu.manifest["files"], name: sha256_of(b"x")}}
    added = with_files(fmu, {name: b"x"}, manifest)
    faults = list(file_faults(added, compensator, sha256_of(to_json_bytes(compensator))))
    assert [fault for fault in faults if name in fault]


def test_a_binary_of_another_machine_is_found(fmu):
    here = next(path for path in fmu.files if path.startswith("binaries/"))
    moved = with_files(fmu, {"binaries/win64/dz_compensator.dll": fmu.files[here]})
    assert any("win64" in fault and "ELF" in fault for fault in library_faults(moved))
    other = bytearray(fmu.files[here])
    other[18] ^= 1
    assert any("processor" in fault for fault in library_faults(with_files(fmu, {here: bytes(other)})))
