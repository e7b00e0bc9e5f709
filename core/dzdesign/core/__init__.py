"""Core: units, errors and artefact files; nothing of the domain's mathematics.

Enters: text and files. Leaves: SI numbers, one-sentence errors, artefacts written whole or not at all.
"""
