"""A logo in a report is an image and nothing else; a report needs nothing from outside."""

import base64
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.report.page import LARGEST_LOGO, logo_uri
from tests.support.html_pages import HOSTILE, Page
from tests.support.synthetic import Truth, synthetic_ramp

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


@pytest.fixture
def valve_folder(tmp_path):
    record = {"serial": HOSTILE[0], "type": HOSTILE[2], "note": HOSTILE[1]}
    valve = identify([synthetic_ramp(1.0, Truth(noise=0.02), ramp_s=20, rate_Hz=25)], record=record)
    (tmp_path / "valve.json").write_bytes(to_json_bytes(valve))
    (tmp_path / "logo.png").write_bytes(PNG)
    return tmp_path


def test_a_report_with_a_logo_needs_nothing_from_outside(valve_folder, capsys):
    page = valve_folder / "with_logo.html"
    options = ["-o", str(page), "--logo", str(valve_folder / "logo.png")]
    assert main(["report", str(valve_folder), *options]) == 1  # not verified
    html = page.read_text(encoding="utf-8")
    (image,) = Page(html).of("img")
    assert base64.b64decode(image["src"].removeprefix("data:image/png;base64,")) == PNG
    assert not Page(html).of("script")
    style = html[html.index("<style>") + len("<style>") : html.index("</style>")]
    # The title stands in the sheet's header, every sign of it escaped.
    assert "<" not in style and "alert\\28 1\\29 " in style
    assert "counter(page)" in style and "counter(pages)" in style
    again = page.read_bytes()
    assert main(["report", str(valve_folder), *options]) == 1
    assert page.read_bytes() == again
    capsys.readouterr()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("logo.svg", b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'/>"),
        ("logo.png", b"<script>alert(1)</script>"),
        ("large.png", PNG + bytes(LARGEST_LOGO)),
        ("empty.png", b""),
    ],
    ids=["SVG", "no image", "too large", "empty"],
)
def test_what_is_no_raster_image_is_refused(tmp_path, name, content):
    path: Path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match="--logo"):
        logo_uri(path)
