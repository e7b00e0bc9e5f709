"""Report: artefacts enter, one HTML page leaves, of a valve or of a lot."""
