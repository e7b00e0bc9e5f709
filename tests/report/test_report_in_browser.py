"""report.html in a real browser: headless Chromium at two widths, light and dark, and printed."""

import contextlib
import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.documents import to_json
from dzdesign.report.artefacts import read_chain
from dzdesign.report.lot.page import report_of_lot
from dzdesign.report.valve_report import REPORT_NAME, make_report, report_of_folder
from tests.support.attacked_firmware import sealed
from tests.support.synthetic import needs_compiler
from tests.support.synthetic_lots import lot_rows, with_figures, write_lot_folder

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
VIEWS = [(1280, "light"), (1280, "dark"), (320, "light")]
#: Of WCAG 2 AA; large or bold text may have less, but has as much here.
CONTRAST = 4.5

pytestmark = [
    pytest.mark.slow,
    needs_compiler,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium (chromium) on the path"),
]

#: Of every text that is seen: its colour on the first opaque background behind it, as a ratio.
CONTRASTS = """() => {
  const channel = v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = c => 0.2126 * channel(c[0]) + 0.7152 * channel(c[1]) + 0.0722 * channel(c[2]);
  const parse = s => { const n = s.match(/[\\d.]+/g).map(Number); return n.length > 3 && n[3] < 1 ? null : n; };
  const behind = e => { for (; e; e = e.parentElement) {
    const c = parse(getComputedStyle(e).backgroundColor); if (c) return c; } return [255, 255, 255]; };
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const e = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || e.closest('style, .skip')) continue;
    const style = getComputedStyle(e), colour = parse(e.closest('svg') ? style.fill : style.color);
    if (!colour) continue;
    const [a, b] = [light(colour), light(behind(e))].sort((x, y) => y - x);
    found.push([(a + 0.05) / (b + 0.05), walker.currentNode.data.trim().slice(0, 40), style.color]);
  }
  return found.sort((x, y) => x[0] - y[0]);
}"""
SIZES = """() => [...document.querySelectorAll('svg, img:not(.logo)')].filter(e => e.checkVisibility()).map(e => {
  const box = e.getBoundingClientRect(); return [box.width, box.height]; })"""
LOST_LINKS = """() => [...document.querySelectorAll('a[href^="#"]')].map(a => a.getAttribute('href'))
  .filter(href => !document.getElementById(decodeURIComponent(href.slice(1))))"""
#: The appendices are folded; what is in them is looked at too.
UNFOLD = "document.querySelectorAll('details.appendix').forEach(each => { each.open = true; })"
#: What reaches beyond the page's right edge without a box that scrolls around it.
BEYOND = """() => [...document.querySelectorAll('main *, nav *')].filter(e =>
    e.getBoundingClientRect().right > document.documentElement.clientWidth + 1 &&
    !e.closest('.scroll, .formula, .long')).map(e => e.tagName + ' ' + e.textContent.slice(0, 40))"""


#: Words of a table or of a number that matters which stand on two lines, unless they may be broken: names, hashes.
SPLIT = """() => {
  const found = [], range = document.createRange();
  for (const e of document.querySelectorAll('td, th, .numbers')) {
    const walker = document.createTreeWalker(e, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
      const text = walker.currentNode;
      if (text.parentElement.closest('math, .breaks, .hash')) continue;
      for (const word of text.data.matchAll(/[\\p{L}\\p{N}]{2,}/gu)) {
        range.setStart(text, word.index);
        range.setEnd(text, word.index + word[0].length);
        const tops = [...range.getClientRects()].filter(box => box.width).map(box => Math.round(box.top));
        if (new Set(tops).size > 1) found.push(word[0]);
      }
    }
  }
  return found;
}"""
#: CSS pixels between the margins of the page that the style sheet prints on: 210 mm less 2 x 14 mm.
PAPER = 688
#: Its height.
PAPER_HEIGHT = 994


@pytest.fixture(scope="module")
def browser():
    # Imported where a browser is: the driver starts a process of its own.
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        flags = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []  # Chromium's rule for root
        with contextlib.closing(driver.chromium.launch(executable_path=CHROMIUM, args=flags)) as started:
            yield started


def with_checks(demo: Path, changes) -> str:
    """Return the report of a demo with other outcomes of some requirements: place -> holds, text."""
    chain = read_chain(demo)
    checks = list(chain.evidence.checks)
    for place, (holds, text) in changes.items():
        checks[place] = replace(checks[place], holds=holds, text=text)
    return make_report(replace(chain, evidence=replace(chain.evidence, checks=tuple(checks)))).html


@pytest.fixture(scope="module")
def pages(reported_demo, tmp_path_factory):
    """The report of the demo; of one that fails with long names; of a valve alone; of a lot with hostile names."""
    folder = tmp_path_factory.mktemp("pages")
    long = "4.19 % ± 0.155 %, 0.188 % more than the limit of 4 % at positive commands and 1.00 MPa"
    changes = {1: (False, "unbroken" * 60), 2: (None, "<b>was not</b> tried")}
    (folder / "failing.html").write_text(with_checks(reported_demo, changes), encoding="utf-8")
    missed = with_checks(reported_demo, {place: (False, long) for place in range(1, 6)})
    (folder / "full.html").write_text(report_of_folder(reported_demo, full=True).html, encoding="utf-8")
    (folder / "missed.html").write_text(missed, encoding="utf-8")
    valve = json.loads((reported_demo / "valve.json").read_bytes())
    valve["record"] = {"serial": "4711", "n" * 60: "unbroken" * 25, "oil": "HLP 46, 40 °C"}
    (folder / "valve.json").write_text(to_json(sealed(valve)))
    (folder / "alone.html").write_text(report_of_folder(folder).html, encoding="utf-8")
    rows = lot_rows(80, failed=(3, 4, 50))
    rows[7] = with_figures(rows[7], offset_V=4.2, knee_opening_V=4.4, name="unbroken" * 12)
    rows[8] = with_figures(rows[8], offset_V=4.25, name="\u5f01 <b>7</b>")
    rows[3] |= {"name": "no-blank-in-it-" * 6, "reason": "unbroken" * 60}
    write_lot_folder(folder / "lot", rows)
    of_lot = report_of_lot(folder / "lot")
    (folder / "lot" / REPORT_NAME).write_text(of_lot.html, encoding="utf-8")
    return {
        "lot": folder / "lot" / REPORT_NAME,
        "demo": reported_demo / "evidence" / REPORT_NAME,
        "failing": folder / "failing.html",
        "missed": folder / "missed.html",
        "in full": folder / "full.html",
        "valve alone": folder / "alone.html",
    }


@contextlib.contextmanager
def opened(browser, path: Path, width: int = 1280, scheme: str = "light"):
    """A page, and what its console said and which requests it made beyond the file."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page, heard = context.new_page(), []
    page.on("console", lambda message: heard.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: heard.append(f"error: {error}"))
    page.on("requestfailed", lambda request: heard.append(f"failed: {request.url[:80]}"))
    page.on("request", lambda request: request.url.startswith(("file:", "data:")) or heard.append(request.url))
    page.goto(path.as_uri())
    page.evaluate(UNFOLD)
    try:
        yield page, heard
    finally:
        context.close()


@pytest.mark.parametrize("name", ["demo", "failing", "valve alone", "lot"])
@pytest.mark.parametrize(("width", "scheme"), VIEWS)
def test_a_page_is_quiet_whole_and_readable(browser, pages, name, width, scheme):
    with opened(browser, pages[name], width, scheme) as (page, heard):
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate(BEYOND) == [] and page.evaluate(SPLIT) == []
        sizes = page.evaluate(SIZES)
        assert len(sizes) == {"demo": 5, "failing": 5, "valve alone": 2, "lot": 1}[name]
        assert all(wide > min(300, 0.9 * width) and high > 100 for wide, high in sizes)
        poor = [found for found in page.evaluate(CONTRASTS) if found[0] < CONTRAST]
        assert poor == []
        assert page.evaluate(LOST_LINKS) == []
        dark = page.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"
        assert dark == (scheme == "dark")
        assert heard == []


#: Of the drawing that is seen: its lower end, and the size of its smallest words in pixels.
LEAD = """() => {
  const svg = [...document.querySelectorAll('#figure-characteristic svg')].find(e => e.checkVisibility());
  const words = [...svg.querySelectorAll('text')].map(e =>
    parseFloat(getComputedStyle(e).fontSize) * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width);
  return [svg.getBoundingClientRect().bottom, Math.min(...words)]; }"""


@pytest.mark.parametrize("name", ["demo", "missed", "valve alone"])
def test_the_characteristic_is_seen_without_scrolling_and_can_be_read(browser, pages, name):
    with opened(browser, pages[name]) as (page, _):
        bottom, smallest = page.evaluate(LEAD)
        assert bottom < 900 and smallest >= 8


@pytest.mark.parametrize("name", ["demo", "missed"])
def test_the_first_sheet_holds_verdict_figure_and_all_tiles(browser, pages, name):
    """Seeded: the last tile stood alone on the second sheet."""
    tops = "[...document.querySelectorAll('.numbers > div')].map(e => Math.round(e.getBoundingClientRect().top))"
    with opened(browser, pages[name], width=PAPER) as (page, _):
        page.emulate_media(media="print")
        assert page.evaluate("document.querySelector('#summary').getBoundingClientRect().bottom") < PAPER_HEIGHT
        assert len(page.evaluate(tops)) == 4 and len(set(page.evaluate(tops))) == 1


def test_the_appendices_are_folded_and_a_link_opens_its_own(browser, pages):
    seen = "document.querySelector('#provenance table').checkVisibility({contentVisibilityAuto: true})"
    height = "document.querySelector('#provenance').getBoundingClientRect().height"
    with opened(browser, pages["demo"]) as (page, _):
        page.reload()
        assert page.evaluate("[...document.querySelectorAll('details.appendix')].every(each => !each.open)")
        assert not page.evaluate(seen)
        page.emulate_media(media="print")
        assert page.evaluate(height) == 0
        page.emulate_media(media="screen")
        page.click('nav a[href="#provenance"]')
        assert page.evaluate(seen)
    with opened(browser, pages["in full"]) as (page, _):
        page.reload()
        assert page.evaluate(seen)


def printed(browser, path: Path, pdf: Path, scheme: str = "light") -> int:
    """Print a page as it is opened, and return on how many sheets it stands."""
    with opened(browser, path, scheme=scheme) as (page, heard):
        page.reload()
        paper = page.pdf(path=pdf, prefer_css_page_size=True)
        assert heard == [] and paper.startswith(b"%PDF")
    return paper.count(b"/Type /Page\n")


@pytest.mark.parametrize("name", ["demo", "failing", "missed"])
def test_a_report_has_at_most_eight_sheets_and_in_full_it_has_more(browser, pages, name, tmp_path):
    count = printed(browser, pages[name], tmp_path / "report.pdf")
    assert 3 <= count <= 8
    assert printed(browser, pages["in full"], tmp_path / "full.pdf") > count


def test_it_prints_on_light_paper_without_what_only_a_screen_needs(browser, pages):
    with opened(browser, pages["demo"], scheme="dark") as (page, heard):
        shown = "getComputedStyle(document.querySelector('.signatures')).display"
        assert page.evaluate(shown) == "none"
        page.emulate_media(media="print")
        assert page.evaluate(shown) == "grid"
        assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert page.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
        assert [found for found in page.evaluate(CONTRASTS) if found[0] < CONTRAST] == []
        assert heard == []


@pytest.mark.parametrize("name", ["failing", "valve alone"])
def test_nothing_runs_off_the_paper(browser, pages, name):
    with opened(browser, pages[name], width=PAPER) as (page, _):
        page.emulate_media(media="print")
        assert page.evaluate(BEYOND.replace("!e.closest('.scroll, .formula, .long')", "true")) == []
        assert page.evaluate(SPLIT) == []


def test_the_checks_see_what_they_must(browser, pages, tmp_path):
    """Each fault is seeded, and each check is seen to find it."""
    text = pages["valve alone"].read_text(encoding="utf-8")
    broken = text.replace(
        "</main>",
        '<p style="width:3000px;color:#ddd">wide and pale</p><a href="#nowhere">x</a>'
        '<table style="width:1px"><td style="overflow-wrap:anywhere;min-width:0">headroom</td></table>'
        '<img src="missing.png"><script>console.log(1)</script></main>',
    )
    path = tmp_path / "broken.html"
    path.write_text(broken, encoding="utf-8")
    with opened(browser, path) as (page, heard):
        assert page.evaluate("document.documentElement.scrollWidth") > 1280
        assert page.evaluate(BEYOND)
        assert page.evaluate(SPLIT) == ["headroom"]
        assert [found for found in page.evaluate(CONTRASTS) if found[0] < CONTRAST]
        assert page.evaluate(LOST_LINKS) == ["#nowhere"]
        assert min(wide for wide, _ in page.evaluate(SIZES)) < 300
        assert {words.partition(":")[0] for words in heard} == {"console", "failed"}


#: A root over a fraction, of display size.
ROOT = "math[display=block] > mtable > mtr > mtd > mrow > msqrt:has(mfrac)"


def has_tail(browser, path: Path, picture: Path) -> bool:
    """Tell whether a root's sign reaches down to the foot of its fraction: ink in the lower left of its box."""
    from matplotlib.image import imread

    with opened(browser, path) as (page, _):
        page.locator(ROOT).first.screenshot(path=picture)
    ink = imread(picture)[..., :3].mean(axis=2) < 0.6
    height, width = ink.shape
    return bool(ink[height * 3 // 5 :, : width // 6].any())


def test_a_root_of_the_derivation_stretches_over_its_fraction(browser, tmp_path):
    page, plain = tmp_path / "derivation.html", tmp_path / "plain.html"
    assert main(["derive", "--format", "html", "-o", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    plain.write_text(re.sub(r"math \{ font-family: [^;]*;", "math { font-family: sans-serif;", text), encoding="utf-8")
    assert has_tail(browser, page, tmp_path / "root.png")
    assert not has_tail(browser, plain, tmp_path / "plain.png")
    assert "m<sup>3</sup>/s/V" in text and "(a constant pressure drop" in text
