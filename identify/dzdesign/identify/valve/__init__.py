"""The valve: `ValveModel`, the artefact valve.json, and the record of the test."""
