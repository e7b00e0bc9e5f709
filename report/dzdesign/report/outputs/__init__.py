"""A folder and the hash of a compensator.json in; every output that was made of that file out, with its check."""
