"""Core: units, errors and artefact files; nothing of the domain's mathematics.

Enters: text and files. Leaves: SI numbers, one-sentence errors, artefacts written whole or not at all.
"""

if __name__ != "dzdesign.core":
    raise ImportError("import this room as dzdesign.core: a top-level 'core' may be another package")
