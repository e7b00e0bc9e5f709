"""Where things lie in a clone."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
GOLDENS = TESTS / "goldens"
GOLDENS_FULL = TESTS / "goldens_full"
DEVICES = TESTS / "support"
