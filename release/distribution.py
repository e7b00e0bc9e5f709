"""`make dist`: wheel, source package, pages, list of components and their checksums, in dist/; same input, same bytes.

The wheel is built from the source package, so that whoever builds it from there gets the same bytes. Both have the time
stamps of hatchling's default, unless SOURCE_DATE_EPOCH says another.
"""

import argparse
import hashlib
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

from packaging.utils import canonicalize_name

from dzdesign.core.version import __version__
from release.components import bill_of_materials, declared_dependencies, packages_needed, release_date

ROOT = Path(__file__).parents[1]
NAME = "dzdesign"
#: The earliest time that a ZIP archive can state.
EARLIEST = (1980, 1, 1, 0, 0, 0)


def build_packages(source: Path, output: Path) -> tuple[Path, Path]:
    """Build the source package of a folder, and the wheel of that package; return both files."""
    output.mkdir(parents=True, exist_ok=True)
    _hatchling("sdist", source, output)
    archive = output / f"{NAME}-{__version__}.tar.gz"
    with tempfile.TemporaryDirectory() as folder, tarfile.open(archive) as packed:
        packed.extraction_filter = getattr(tarfile, "data_filter", lambda member, _: member)  # of Python 3.11.4
        packed.extractall(folder)
        _hatchling("wheel", Path(folder) / f"{NAME}-{__version__}", output)
    return archive, output / f"{NAME}-{__version__}-py3-none-any.whl"


def _hatchling(kind: str, source: Path, output: Path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(output.resolve())]
    done = subprocess.run(command, cwd=source, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"hatchling could not build the {kind} of {source}:\n{done.stderr}")


def write_components(root: Path, output: Path) -> Path:
    """Write the CycloneDX file of the run-time dependencies that are installed here."""
    requirements = declared_dependencies(root / "pyproject.toml")
    text = bill_of_materials(
        NAME, __version__, packages_needed(requirements),
        direct={canonicalize_name(each.name) for each in requirements},
        released=release_date(root / "CITATION.cff"),
    )  # fmt: skip
    path = output / f"{NAME}-{__version__}.cdx.json"
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


def pack_pages(site: Path, output: Path) -> Path:
    """Pack the built pages, in order and without times; what Sphinx keeps beside them names folders of this machine."""
    top = f"{NAME}-{__version__}-docs"
    path = output / f"{top}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for page in sorted(page for page in site.rglob("*") if page.is_file()):
            name = page.relative_to(site)
            if any(part.startswith(".") for part in name.parts):  # .doctrees, .buildinfo
                continue
            entry = zipfile.ZipInfo(f"{top}/{name.as_posix()}", EARLIEST)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            packed.writestr(entry, page.read_bytes())
    return path


def write_checksums(files: list[Path], output: Path) -> Path:
    """Write the SHA-256 of each file, as `sha256sum --check` reads them."""
    path = output / "SHA256SUMS"
    lines = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(files)]
    path.write_text("".join(lines), encoding="utf-8", newline="\n")
    return path


def main() -> int:
    """Build everything and print what it is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="Folder for the files.")
    parser.add_argument("--pages", type=Path, help="Folder of the built pages, to be packed.")
    arguments = parser.parse_args()
    for old in arguments.output.glob(f"{NAME}-*"):
        old.unlink()
    files = [*build_packages(ROOT, arguments.output), write_components(ROOT, arguments.output)]
    if arguments.pages:
        files.append(pack_pages(arguments.pages, arguments.output))
    write_checksums(files, arguments.output)
    for file in files:
        print(f"{file.stat().st_size / 1e6:8.2f} MB  {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
