"""The files around the core, run on a model of their device: from the converter's channels to the pins."""
