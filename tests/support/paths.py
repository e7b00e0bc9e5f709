"""Where things lie in a clone."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
#: The source roots, in the order in which a room may import another.
ROOMS = ("core", "derivation", "identify", "design", "codegen", "verify", "assess", "report", "dzdesign")
TESTS = ROOT / "tests"
GOLDENS = TESTS / "goldens"
GOLDENS_FULL = TESTS / "goldens_full"
