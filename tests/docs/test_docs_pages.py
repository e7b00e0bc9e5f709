"""The pages of the documentation, tried as a reader would: every command that they show, and what it prints."""

import ast
import inspect
import re
import shutil

import pytest

from dzdesign import api
from dzdesign.command_line.parser import build_parser
from dzdesign.example import example_folder
from tests.support.documented_commands import Command, agrees, commands_of, run, try_page
from tests.support.octave import OCTAVE
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

DOCS = ROOT / "docs"
TUTORIAL = DOCS / "tutorial.md"
#: Goes on in a clone of dzdesign: tests/codegen/test_targets.py runs it.
ADD_TARGET = DOCS / "howto" / "add-target.md"
#: Pages that begin in the folder of `dzdesign demo`, each with a copy of it.
HOW_TO = [
    DOCS / "before-after.md",
    *sorted(
        page
        for page in (DOCS / "howto").glob("*.md")
        if page != ADD_TARGET and commands_of(page.read_text(encoding="utf-8"))
    ),
]

pytestmark = [
    pytest.mark.slow,
    needs_compiler,
    pytest.mark.skipif(shutil.which("bash") is None, reason="the pages' commands need bash"),
]


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """The folder that `dzdesign demo demo` makes."""
    folder = tmp_path_factory.mktemp("docs")
    status, printed = run(Command(shown="$ dzdesign demo demo", output="", status=0), folder)
    assert status == 0, printed
    return folder / "demo"


def test_the_tutorial_prints_what_it_shows(tmp_path, request):
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "example").symlink_to(example_folder())  # as `dzdesign demo demo` leaves it
    assert try_page(TUTORIAL, tmp_path, request.config.getoption("--update-docs")) == []
    assert (tmp_path / "evidence" / "verification.json").is_file() and (tmp_path / "assessment.json").is_file()


@pytest.mark.parametrize("page", HOW_TO, ids=lambda page: page.stem)
def test_a_how_to_page_prints_what_it_shows(demo, page, tmp_path, request):
    if page.stem == "matlab" and OCTAVE is None:
        pytest.skip("no octave-cli on the path: apt install octave")
    folder = tmp_path / "page"
    shutil.copytree(demo, folder, symlinks=True)
    assert try_page(page, folder, request.config.getoption("--update-docs")) == []


def test_every_command_of_every_page_and_of_the_readme_is_one_that_dzdesign_knows():
    """Those that are not run, too: in code blocks of any kind, options and all."""
    assert len(HOW_TO) > 3
    tried, parser = 0, build_parser()[0]
    for page in (ROOT / "README.md", *DOCS.rglob("*.md")):
        text = page.read_text(encoding="utf-8").replace("\\\n", " ")
        for line in re.findall(r"^ *(?:\$ |\.venv\\Scripts\\|uv run )?(dzdesign [a-z].*)$", text, re.MULTILINE):
            words = without_shell(line)
            if words[0] == "dzdesign" and not {"--help", "--version"} & set(words):
                parser.parse_args(words[1:])
                tried += 1
    assert tried > 30


def unknown_keywords(text):
    """Return how many calls of `dzdesign.api` the indented Python of a page has, and the keywords that none takes."""
    calls = re.findall(r"^    .*\bapi\.\w+\(.*$", text, re.MULTILINE)
    trees = [ast.walk(ast.parse(line.strip())) for line in calls]
    found = [node for tree in trees for node in tree if isinstance(node, ast.Call)]
    found = [node for node in found if isinstance(node.func, ast.Attribute) and ast.unparse(node.func.value) == "api"]
    return len(found), [
        f"{node.func.attr}({word.arg})"
        for node in found
        for word in node.keywords
        if word.arg not in inspect.signature(getattr(api, node.func.attr)).parameters
    ]


def test_every_call_of_the_api_in_the_pages_is_one_that_it_takes():
    assert unknown_keywords((DOCS / "reference" / "api.md").read_text("utf-8")) == (5, [])
    wrong = '    firmware = api.generate(api.design(valve, edge="1 %"), output="firmware")\n'
    assert unknown_keywords(wrong) == (2, ["design(edge)"])


def without_shell(line):
    """Return the words of the one dzdesign command in a line of shell."""
    import shlex

    words = shlex.split(line.split(" | ")[0].split(" > ")[0].split(" && ")[0], comments=True)
    return ["OUT" if word.startswith("$") else word for word in words if not re.match(r"\d?>", word)]


def test_the_runner_sees_a_wrong_page(tmp_path):
    page = tmp_path / "page.md"
    good = "```console\n$ printf 'a\\nb\\nc\\n'\na\n...\nc\n$ false  # exit status 1\n```\n"
    page.write_text(good)
    assert try_page(page, tmp_path, update=False) == []
    for right, wrong in (
        ("\nc\n", "\nd\n"),
        ("exit status 1", "exit status 0"),
        ("a\n...\nc", "a\nc"),
        ("\na\n", "\nb\n"),
    ):
        page.write_text(good.replace(right, wrong, 1))
        assert len(try_page(page, tmp_path, update=False)) == 1, wrong


def test_the_runner_updates_what_a_page_shows(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("text\n```console\n$ echo new\nold\n$ true\n```\nmore\n")
    assert try_page(page, tmp_path, update=True) == []
    assert page.read_text() == "text\n```console\n$ echo new\nnew\n$ true\n```\nmore\n"


def test_a_file_in_c_that_a_page_shows_is_there_when_its_commands_run(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("`one.c` is all\nthat is needed:\n\n```c\nint one;\n```\n\nOf `two.c`:\n\n```c\nint two;\n```\n\n"
                    "```console\n$ cat one.c; ls *.c\nint one;\none.c\n```\n")  # fmt: skip
    assert try_page(page, tmp_path, update=False) == []
    page.write_text(page.read_text().replace("int one;\n```", "int other;\n```"))
    assert len(try_page(page, tmp_path, update=False)) == 1


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("", "a", False),
        ("...\nb", "a\nb\nc", False),
        ("a\n...\nb\n...\nd", "a\nx\nb\ny\nd", True),
        ("a\n...\nb\n...\nd", "a\nx\ny\nd", False),
        ("hash …, 3", "hash 5f, 3", True),
        ("hash …, 3", "hash 5f,\n3", False),
    ],
)
def test_three_points_stand_for_any_lines(shown, printed, same):
    assert agrees(shown, printed) is same
