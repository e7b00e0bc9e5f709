"""Planning: what a bench and a valve are expected to be like enters; a series of ramp tests and its bound leave."""
